#include "rtstdb/log/disk.hpp"

#include <system_error>

namespace rtstdb::log {
namespace {

const char* to_string(DiskCall call) {
  switch (call) {
    case DiskCall::create:
      return "create";
    case DiskCall::open:
      return "open";
    case DiskCall::read:
      return "read";
    case DiskCall::write:
      return "write";
    case DiskCall::preallocate:
      return "preallocate";
    case DiskCall::sync:
      return "sync";
    case DiskCall::size:
      return "size";
    case DiskCall::list:
      return "list";
    case DiskCall::rename:
      return "rename";
    case DiskCall::remove:
      return "remove";
    case DiskCall::sync_directory:
      return "sync of the directory";
    case DiskCall::lock:
      return "lock";
    case DiskCall::allocate:
      return "memory";
  }
  return "call";
}

}  // namespace

std::string DiskError::describe() const {
  const std::string what = file.empty() ? to_string(call) : std::string(to_string(call)) + " of " + file;
  return what + ": " + std::generic_category().message(number);
}

}  // namespace rtstdb::log
