#pragma once
// Keeps in memory what modules hand over for files.

#include <algorithm>
#include <cstddef>
#include <memory>
#include <vector>

#include <hil/file_stream.hpp>

namespace hil::modules::test {

struct CollectedBuffer {
  std::vector<std::byte> bytes{};
  std::int64_t time_ns = 0;
};

/// Has room for a number of buffers; further ones are dropped. `options` are those of the last stream.
class CollectedFiles final : public FileStreams {
 public:
  static constexpr std::size_t capacity = 32;

  std::unique_ptr<FileStream> open(const FileStreamOptions& given) override {
    options = given;
    memory_.assign(capacity, {.bytes = std::vector<std::byte>(given.buffer_bytes)});
    count = 0;
    return std::make_unique<Stream>(*this);
  }
  /// The buffer of that number, as far as it was filled.
  std::span<std::byte> buffer(std::size_t number) { return std::span(memory_[number].bytes); }
  std::int64_t time_ns(std::size_t number) const { return memory_[number].time_ns; }
  void clear() {
    for (CollectedBuffer& one : memory_)
      one.bytes.resize(options.buffer_bytes);
    count = 0;
  }

  FileStreamOptions options{};
  std::size_t count = 0;  ///< of buffers that were handed over

 private:
  class Stream final : public FileStream {
   public:
    explicit Stream(CollectedFiles& all) : all_(all) {}
    std::span<std::byte> begin() noexcept override {
      return all_.count == capacity ? std::span<std::byte>() : all_.buffer(all_.count);
    }
    void finish(std::size_t bytes, std::int64_t time_ns) noexcept override {
      CollectedBuffer& filled = all_.memory_[all_.count++];
      filled.bytes.resize(bytes);
      filled.time_ns = time_ns;
    }
    FileStreamRecord record() const override { return {}; }

   private:
    CollectedFiles& all_;
  };

  std::vector<CollectedBuffer> memory_;
};

}  // namespace hil::modules::test
