#include "rtstdb/geometry/bounded_reading.hpp"

#include <assimp/IOStream.hpp>

#include <memory>
#include <stdexcept>
#include <utility>

namespace rtstdb {
namespace {

/// A reader that is well may look past the end a few times: once per buffer and once per probe of the format.
constexpr int empty_reads_allowed = 100;

class BoundedStream final : public Assimp::IOStream {
 public:
  explicit BoundedStream(std::unique_ptr<Assimp::IOStream> file) : file_(std::move(file)) {}

  std::size_t Read(void* buffer, std::size_t size, std::size_t count) override {
    const std::size_t read = file_->Read(buffer, size, count);
    if (read == 0 && ++empty_reads_ > empty_reads_allowed)
      throw std::runtime_error("the file ends before its content does");
    return read;
  }
  std::size_t Write(const void* buffer, std::size_t size, std::size_t count) override {
    return file_->Write(buffer, size, count);
  }
  aiReturn Seek(std::size_t offset, aiOrigin origin) override { return file_->Seek(offset, origin); }
  std::size_t Tell() const override { return file_->Tell(); }
  std::size_t FileSize() const override { return file_->FileSize(); }
  void Flush() override { file_->Flush(); }

 private:
  std::unique_ptr<Assimp::IOStream> file_;
  int empty_reads_ = 0;
};

}  // namespace

Assimp::IOStream* BoundedReading::Open(const char* path, const char* mode) {
  std::unique_ptr<Assimp::IOStream> file(DefaultIOSystem::Open(path, mode));
  // Assimp owns what Open returns and gives it back through Close, which deletes it.
  return file == nullptr ? nullptr : std::make_unique<BoundedStream>(std::move(file)).release();
}

}  // namespace rtstdb
