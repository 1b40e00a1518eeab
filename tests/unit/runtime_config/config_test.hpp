#pragma once
// What the tests of runtime/config share.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>

#include "runtime/config/diagnostics.hpp"
#include "runtime/config/parse.hpp"
#include "runtime/config/scenario.hpp"

namespace hil::config::testing {

/// A folder of its own for a test, gone with it.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "hil_config_XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder: " + pattern);
    path_ = pattern;
  }
  ~TemporaryFolder() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::string write(const std::string& name, std::string_view text) const {
    const std::filesystem::path file = path_ / name;
    std::ofstream stream(file, std::ios::binary);
    stream << text;
    stream.close();
    if (!stream) throw std::runtime_error("can not write " + file.string());
    return file.string();
  }

 private:
  std::filesystem::path path_;
};

/// Whether there is exactly the one mistake, at that place, with these words in its sentence.
inline ::testing::AssertionResult is_only_mistake(const Diagnostics& diagnostics, std::uint32_t line,
                                                  std::uint32_t column, std::string_view words) {
  if (diagnostics.count() == 1) {
    const Mistake& mistake = diagnostics.mistakes()[0];
    if (mistake.place.line == line && mistake.place.column == column &&
        mistake.message.find(words) != std::string::npos) {
      return ::testing::AssertionSuccess();
    }
  }
  return ::testing::AssertionFailure() << "expected one mistake at " << line << ":" << column << " with \""
                                       << words << "\", but there are " << diagnostics.count() << ":\n"
                                       << diagnostics.to_text();
}

/// Whether such a mistake is among them.
inline ::testing::AssertionResult has_mistake(const Diagnostics& diagnostics, std::uint32_t line,
                                              std::uint32_t column, std::string_view words) {
  for (const Mistake& mistake : diagnostics.mistakes()) {
    if (mistake.place.line == line && mistake.place.column == column &&
        mistake.message.find(words) != std::string::npos) {
      return ::testing::AssertionSuccess();
    }
  }
  return ::testing::AssertionFailure()
         << "no mistake at " << line << ":" << column << " with \"" << words << "\" in:\n"
         << diagnostics.to_text();
}

}  // namespace hil::config::testing
