#include "runtime/run/step_guard.hpp"

#include <signal.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <exception>

#include "runtime/plugins/plugins.hpp"

namespace hil::run {
namespace {

thread_local const char* stepped_module = nullptr;

constexpr std::array fatal_signals{SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};

/// Of the standard error stream; only functions that a handler may call.
void write_text(const char* text) noexcept {
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, text, std::strlen(text));
}

void report_signal(int number) {
  if (stepped_module != nullptr) {
    write_text("hil: ");
    write_text(stepped_module);
    write_text(": its step ended by ");
    const char* const name = ::sigabbrev_np(number);
    write_text(name == nullptr ? "a signal" : "SIG");
    write_text(name == nullptr ? "" : name);
    write_text("\n");
  }
  ::signal(number, SIG_DFL);
  ::raise(number);
}

}  // namespace

StepGuard::StepGuard(const std::string& module) noexcept {
  stepped_module = module.c_str();
}

StepGuard::~StepGuard() {
  stepped_module = nullptr;
}

void report_signals_of_steps() {
  struct sigaction action {};
  action.sa_handler = report_signal;
  action.sa_flags = SA_ONSTACK;
  sigemptyset(&action.sa_mask);
  for (const int number : fatal_signals) {
    struct sigaction before {};
    // Another handler, as that of a sanitizer, has more to say.
    if (::sigaction(number, nullptr, &before) == 0 && before.sa_handler == SIG_DFL)
      ::sigaction(number, &action, nullptr);
  }
}

std::string text_of_exception() noexcept {
  try {
    try {
      throw;
    } catch (const std::exception& error) {
      return error.what();
    } catch (...) {
      return "an exception without a text";
    }
  } catch (...) {
    return {};  // no memory for the text
  }
}

std::string name_with_plugin(const std::string& module, const std::string& type) {
  const std::string plugin = plugins::plugin_of(type);
  return "module " + module + (plugin.empty() ? "" : " (plug-in " + plugin + ")");
}

}  // namespace hil::run
