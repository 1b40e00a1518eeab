#include "runtime/run/run_log.hpp"

#include <spdlog/logger.h>
#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/sinks/stdout_sinks.h>

#include <cerrno>
#include <cstdio>
#include <system_error>

#include "io/device.hpp"

namespace hil::run {

RunLog::RunLog(const std::filesystem::path& file, bool to_console, bool replace) : to_console_(to_console) {
  try {
    const auto to_file = std::make_shared<spdlog::sinks::basic_file_sink_mt>(file.string(), replace);
    logger_ = std::make_shared<spdlog::logger>("hil", to_file);
  } catch (const spdlog::spdlog_ex& error) {
    throw io::DeviceError(error.what());
  }
  if (to_console) logger_->sinks().push_back(std::make_shared<spdlog::sinks::stderr_sink_mt>());
  logger_->set_pattern("%Y-%m-%d %H:%M:%S.%e %l: %v");
  logger_->flush_on(spdlog::level::info);
  logger_->set_error_handler([this](const std::string& /*text*/) {  // it is called right after the failure
    const int error = errno;
    const std::scoped_lock lock(mutex_);
    if (fault_.empty()) fault_ = "run.log could not be written: " + std::generic_category().message(error);
  });
}

void RunLog::info(const std::string& sentence) {
  logger_->info(sentence);
}

void RunLog::progress(const std::string& sentence) {
  logger_->info(sentence);
  if (!to_console_) std::fprintf(stderr, "hil run: %s\n", sentence.c_str());
}

void RunLog::warn(const std::string& sentence) {
  logger_->warn(sentence);
}

std::string RunLog::fault() const {
  const std::scoped_lock lock(mutex_);
  return fault_;
}

}  // namespace hil::run
