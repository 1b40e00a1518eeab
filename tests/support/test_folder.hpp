#pragma once

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include "tests/support/temporary_folder.hpp"

namespace hil::tests {

/// A temporary folder whose files a test writes and reads.
class TestFolder : public TemporaryFolder {
 public:
  /// Creates missing folders of `name`. Returns the file's path.
  std::string write(const std::string& name, std::string_view text) const {
    const std::filesystem::path file = path() / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream stream(file, std::ios::binary);
    stream << text;
    stream.close();
    if (!stream) throw std::runtime_error("can not write " + file.string());
    return file.string();
  }
  std::string read(const std::string& name) const { return content_of(path() / name); }
};

}  // namespace hil::tests
