#include "rtstdb/log/page_buffer.hpp"

#include <sys/mman.h>

#include <cstring>
#include <new>

#include "rtstdb/log/disk.hpp"
#include "rtstdb/log/format.hpp"

namespace rtstdb::log {
namespace {

constexpr std::size_t large_page_bytes = std::size_t{2} << 20;

std::size_t page_for(std::size_t bytes) {
  return bytes < large_page_bytes ? disk_page_bytes : large_page_bytes;
}

}  // namespace

PageBuffer::PageBuffer(std::size_t bytes) : count_(bytes), start_(nullptr, Delete{page_for(bytes)}) {
  const std::size_t page = page_for(bytes);
  const std::size_t whole = round_up(bytes, page);
  start_.reset(static_cast<std::byte*>(::operator new (whole, std::align_val_t{page})));
  if (page == large_page_bytes) ::madvise(start_.get(), whole, MADV_HUGEPAGE);  // a hint; may be ignored
  std::memset(start_.get(), 0, whole);
}

void PageBuffer::Delete::operator()(std::byte* start) const noexcept {
  ::operator delete (start, std::align_val_t{alignment});
}

}  // namespace rtstdb::log
