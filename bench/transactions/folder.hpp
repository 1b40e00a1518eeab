#pragma once
// A folder that is gone afterwards, where TMPDIR says, or in /tmp: that is the disk which is measured.

#include <filesystem>

namespace hil::bench {

class Folder {
 public:
  /// Throws std::runtime_error where none can be made.
  Folder();
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace hil::bench
