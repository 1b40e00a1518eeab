#include "rtstdb/log/whole_file.hpp"

namespace rtstdb::log {

DiskResult<std::vector<std::byte>> read_whole_file(Disk& disk, std::string_view name) {
  auto file = disk.open(name);
  if (!file) return file.error();
  auto size = file.value()->size();
  if (!size) return size.error();
  std::vector<std::byte> bytes(size.value());
  auto count = file.value()->read(0, bytes);
  if (!count) return count.error();
  bytes.resize(count.value());  // the file may have been truncated since
  return bytes;
}

}  // namespace rtstdb::log
