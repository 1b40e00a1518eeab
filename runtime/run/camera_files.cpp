#include "runtime/run/camera_files.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <system_error>
#include <utility>

#include "io/device.hpp"
#include "runtime/run/image_files.hpp"
#include "runtime/run/png_file.hpp"
#include "runtime/run/write_ring.hpp"

namespace hil::run {
namespace {

std::uint64_t size_of(const std::filesystem::path& file) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(file, error);
  return error ? 0 : bytes;
}

}  // namespace

/// The buffers of one stream: the tick fills them in turn, and the writing thread writes them to files.
class CameraFiles::Buffers {
 public:
  Buffers(std::filesystem::path folder, const modules::CameraStreamOptions& options, bool waits,
          std::int64_t tick_ns)
      : folder_(std::move(folder)),
        options_(options),
        sensor_(options.sensor),
        tick_ns_(tick_ns),
        ring_(waits) {
    const std::size_t pixels = std::size_t{options.width} * options.height;
    const bool has_noise = sensor_.has_noise();
    for (Slot& slot : ring_.slots()) {
      slot.color.resize(options.has_images && has_noise ? pixels : 0);
      slot.srgb.resize(options.has_images ? pixels : 0);
      slot.depth_m.resize(options.depth_step_m > 0.0 ? pixels : 0);
    }
    record_.name = options.name;
    record_.max_bytes = options.max_bytes;
    record_.width = options.width;
    record_.height = options.height;
    rgb_.resize(ring_.slots()[0].srgb.size() * 3);
    record_.last_rgb.resize(rgb_.size());
  }

  // ---- the tick
  std::optional<modules::CameraFrame> begin() noexcept {
    slot_ = ring_.begin();
    if (slot_ == nullptr) return std::nullopt;
    modules::CameraFrame frame{.color = slot_->color, .depth_m = slot_->depth_m};
    if (slot_->color.empty()) frame.srgb = slot_->srgb;
    return frame;
  }
  void finish(std::int64_t time_ns) noexcept {
    slot_->time_ns = time_ns;
    ring_.finish();
  }

  // ---- the writing thread; close
  void write_filled() {
    ring_.write_filled([this](Slot& slot) { write(slot); });
  }
  /// After the last tick.
  CameraFileRecord close() {
    ring_.close();
    write_filled();
    record_.dropped = ring_.lost();
    if (!has_image_) record_.last_rgb.clear();
    return std::move(record_);
  }

 private:
  struct Slot {
    std::vector<rtstdb::HalfColor> color{};
    std::vector<rtstdb::SrgbColor> srgb{};
    std::vector<float> depth_m{};
    std::int64_t time_ns = 0;
  };

  void write(Slot& slot) {
    if (bytes_ >= options_.max_bytes) {
      ++record_.beyond_limit;
      return;
    }
    char number[32];
    std::snprintf(number, sizeof number, "-%06lld", static_cast<long long>(slot.time_ns / tick_ns_));
    const std::string name = "camera-" + options_.name + number;
    if (!slot.depth_m.empty()) {
      const std::vector<std::uint16_t> depths = depth_samples(slot.depth_m, options_.depth_step_m);
      write_file(PngImage::Grey16{depths}, name + "-depth.png", slot.time_ns);
    }
    if (slot.srgb.empty()) return;
    if (!slot.color.empty()) sensor_.develop(slot.color, slot.time_ns, slot.srgb);
    for (std::size_t i = 0; i < slot.srgb.size(); ++i)
      std::copy_n(slot.srgb[i].begin(), 3, rgb_.begin() + static_cast<std::ptrdiff_t>(3 * i));
    if (!write_file(PngImage::Rgb8{rgb_}, name + ".png", slot.time_ns)) return;
    std::swap(rgb_, record_.last_rgb);
    has_image_ = true;
  }

  /// Whether the file is complete.
  template <class Pixels>
  bool write_file(const Pixels& pixels, const std::string& name, std::int64_t time_ns) {
    const std::filesystem::path file = folder_ / name;
    const std::string fault =
        write_png({.width = options_.width, .height = options_.height, .pixels = pixels}, file);
    if (!fault.empty()) {
      if (record_.failed++ == 0) record_.first_fault = fault;
      return false;
    }
    bytes_ += size_of(file);
    record_.last_file = (folder_.filename() / name).string();
    record_.last_time_ns = time_ns;
    return true;
  }

  const std::filesystem::path folder_;
  const modules::CameraStreamOptions options_;
  const modules::ImageSensor sensor_;
  const std::int64_t tick_ns_;
  WriteRing<Slot> ring_;
  Slot* slot_ = nullptr;  // that the tick fills
  // Of the writing thread.
  std::vector<std::uint8_t> rgb_;
  std::uint64_t bytes_ = 0;
  bool has_image_ = false;  // in record_.last_rgb
  CameraFileRecord record_;
};

class CameraFiles::Stream final : public modules::CameraImageStream {
 public:
  explicit Stream(std::shared_ptr<Buffers> buffers) : buffers_(std::move(buffers)) {}
  std::optional<modules::CameraFrame> begin() noexcept override { return buffers_->begin(); }
  void finish(std::int64_t time_ns) noexcept override { buffers_->finish(time_ns); }

 private:
  std::shared_ptr<Buffers> buffers_;
};

CameraFiles::CameraFiles(const std::filesystem::path& run_folder, bool virtual_clock, std::int64_t tick_ns)
    : folder_(image_folder(run_folder)), virtual_clock_(virtual_clock), tick_ns_(tick_ns) {}

CameraFiles::~CameraFiles() {
  close();
}

std::unique_ptr<modules::CameraImageStream> CameraFiles::open(const modules::CameraStreamOptions& options) {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) throw io::DeviceError("folder " + folder_.string() + " can not be created: " + error.message());
  // The thread reads the list without a lock, so it is stopped while the list changes.
  stopping_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
  streams_.push_back(std::make_shared<Buffers>(folder_, options, virtual_clock_, tick_ns_));
  stopping_.store(false, std::memory_order_release);
  thread_ = std::thread([this] { serve(); });
  return std::make_unique<Stream>(streams_.back());
}

void CameraFiles::serve() {
  while (!stopping_.load(std::memory_order_acquire)) {
    for (const std::shared_ptr<Buffers>& stream : streams_)
      stream->write_filled();
    std::this_thread::sleep_for(std::chrono::milliseconds(virtual_clock_ ? 1 : 5));
  }
}

std::vector<CameraFileRecord> CameraFiles::close() {
  stopping_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
  std::vector<CameraFileRecord> records;
  for (const std::shared_ptr<Buffers>& stream : streams_)
    records.push_back(stream->close());
  streams_.clear();
  return records;
}

}  // namespace hil::run
