#include "runtime/run/file_streams.hpp"

#include <chrono>
#include <string_view>
#include <system_error>
#include <utility>

#include <hil/module.hpp>
#include <hil/require.hpp>

#include "runtime/report/quantities.hpp"
#include "runtime/run/contributed_files.hpp"
#include "runtime/run/png_file.hpp"
#include "runtime/run/write_ring.hpp"

namespace hil::run {

/// The buffers of one stream: the tick fills them in turn, and the writing thread makes files of them.
class RunFileStreams::Buffers final : public modules::FileOutput {
 public:
  Buffers(const std::filesystem::path& run_folder, const modules::FileStreamOptions& options, bool waits)
      : options_(options), folder_(run_folder / options.folder), ring_(waits) {
    for (Slot& slot : ring_.slots())
      slot.bytes.resize(options.buffer_bytes);
  }

  // ---- the tick
  std::span<std::byte> begin() noexcept {
    slot_ = ring_.begin();
    return slot_ == nullptr ? std::span<std::byte>() : slot_->bytes;
  }
  void finish(std::size_t bytes, std::int64_t time_ns) noexcept {
    slot_->filled = bytes;
    slot_->time_ns = time_ns;
    ring_.finish();
  }

  // ---- the writing thread; close
  void write_filled() {
    ring_.write_filled([this](Slot& slot) {
      if (bytes_ >= options_.max_bytes) {
        ++record_.beyond_limit;
        return;
      }
      time_ns_ = slot.time_ns;
      is_whole_ = true;
      options_.encoder->encode(std::span(slot.bytes).first(slot.filled), slot.time_ns, *this);
      if (!is_whole_) ++failed_;
    });
  }
  bool write(const std::string& name, std::span<const std::byte> content) override {
    const std::string_view text(reinterpret_cast<const char*>(content.data()), content.size());
    const std::string fault = write_file(folder_ / name, text);
    return fault.empty() ? note_file(name) : note_fault(fault);
  }
  bool write(const std::string& name, const modules::PngImage& image) override {
    const std::string fault = write_png(image, folder_ / name);
    return fault.empty() ? note_file(name) : note_fault(fault);
  }

  // ---- after the last tick
  void close(Shortfalls& shortfalls) {
    ring_.close();
    write_filled();
    record_.dropped = ring_.lost();
    const std::string of_owner = " of " + options_.owner;
    const auto counted = [this](std::uint64_t count) {
      return report::counted(count, options_.singular.c_str(), options_.plural.c_str());
    };
    const auto not_in_files = [](std::uint64_t count) {
      return count == 1 ? " is not in a file" : " are not in files";
    };
    if (record_.dropped > 0)
      shortfalls.failures.push_back(counted(record_.dropped) + of_owner + not_in_files(record_.dropped) +
                                    ": the disk was too slow");
    if (failed_ > 0)
      shortfalls.failures.push_back(counted(failed_) + of_owner +
                                    " could not be written; the first: " + first_fault_);
    if (record_.beyond_limit > 0)
      shortfalls.limits.push_back(
          "the files" + of_owner + " reached " + report::bytes_text(options_.max_bytes) + " ('max_size'); " +
          counted(record_.beyond_limit) + " after that" + not_in_files(record_.beyond_limit));
  }
  const modules::FileStreamRecord& record() const noexcept { return record_; }

 private:
  struct Slot {
    std::vector<std::byte> bytes{};
    std::size_t filled = 0;
    std::int64_t time_ns = 0;
  };

  bool note_file(const std::string& name) {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(folder_ / name, error);
    if (!error) bytes_ += size;
    record_.last_file = options_.folder + "/" + name;
    record_.last_time_ns = time_ns_;
    return true;
  }
  bool note_fault(const std::string& fault) {
    if (first_fault_.empty()) first_fault_ = fault;
    return is_whole_ = false;
  }

  const modules::FileStreamOptions options_;
  const std::filesystem::path folder_;
  WriteRing<Slot> ring_;
  Slot* slot_ = nullptr;  // that the tick fills
  // Of the writing thread.
  modules::FileStreamRecord record_;
  std::uint64_t bytes_ = 0;  // in files
  std::int64_t time_ns_ = 0;
  bool is_whole_ = true;      // all files of this buffer could be written
  std::uint64_t failed_ = 0;  // buffers
  std::string first_fault_;
};

class RunFileStreams::Stream final : public modules::FileStream {
 public:
  explicit Stream(std::shared_ptr<Buffers> buffers) : buffers_(std::move(buffers)) {}
  std::span<std::byte> begin() noexcept override { return buffers_->begin(); }
  void finish(std::size_t bytes, std::int64_t time_ns) noexcept override { buffers_->finish(bytes, time_ns); }
  modules::FileStreamRecord record() const override { return buffers_->record(); }

 private:
  std::shared_ptr<Buffers> buffers_;
};

RunFileStreams::RunFileStreams(const std::filesystem::path& run_folder, bool virtual_clock)
    : run_folder_(run_folder), virtual_clock_(virtual_clock) {}

RunFileStreams::~RunFileStreams() {
  close();
}

std::unique_ptr<modules::FileStream> RunFileStreams::open(const modules::FileStreamOptions& options) {
  const std::filesystem::path folder = run_folder_ / options.folder;
  config::require(folder == image_folder(run_folder_) || folder == point_cloud_folder(run_folder_) ||
                      folder == other_folder(run_folder_),
                  "the folder of a stream is images, pointclouds or files");
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    throw modules::SetupError("folder " + folder.string() + " can not be created: " + error.message(),
                              modules::SetupError::Fault::file);
  stop();  // the thread reads the list without a lock
  streams_.push_back(std::make_shared<Buffers>(run_folder_, options, virtual_clock_));
  stopping_.store(false, std::memory_order_release);
  thread_ = std::thread([this] { serve(); });
  return std::make_unique<Stream>(streams_.back());
}

void RunFileStreams::stop() {
  stopping_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
}

void RunFileStreams::serve() {
  while (!stopping_.load(std::memory_order_acquire)) {
    for (const std::shared_ptr<Buffers>& stream : streams_)
      stream->write_filled();
    std::this_thread::sleep_for(std::chrono::milliseconds(virtual_clock_ ? 1 : 5));
  }
}

RunFileStreams::Shortfalls RunFileStreams::close() {
  stop();
  Shortfalls shortfalls;
  for (const std::shared_ptr<Buffers>& stream : streams_)
    stream->close(shortfalls);
  streams_.clear();
  return shortfalls;
}

}  // namespace hil::run
