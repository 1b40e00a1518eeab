#include "runtime/run/camera_record.hpp"

#include <algorithm>
#include <string>

#include "runtime/report/quantities.hpp"
#include "runtime/run/report_image.hpp"

namespace hil::run {
namespace {

/// "1 image of camera front is not in a file".
std::string images_without_file(std::uint64_t count, const std::string& which) {
  return count == 1 ? "1 image " + which + " is not in a file"
                    : std::to_string(count) + " images " + which + " are not in files";
}

void add_sentences(const CameraFileRecord& files, report::RunRecord& record) {
  const std::string camera = "of camera " + files.name;
  if (files.dropped > 0)
    record.failures.push_back(images_without_file(files.dropped, camera) + ": the disk was too slow");
  if (files.failed > 0)
    record.failures.push_back(std::to_string(files.failed) + (files.failed == 1 ? " file " : " files ") +
                              camera + " could not be written; the first: " + files.first_fault);
  if (files.beyond_limit > 0)
    record.realtime.degraded.push_back("the files " + camera + " reached " +
                                       report::bytes_text(files.max_bytes) + " ('max_size'); " +
                                       images_without_file(files.beyond_limit, "after that"));
}

}  // namespace

void add_cameras(std::span<const contribution::Camera> cameras, std::span<const CameraFileRecord> files,
                 report::RunRecord& record) {
  for (const contribution::Camera& camera : cameras) {
    report::Camera entry{.name = camera.name,
                         .images = camera.images,
                         .missing_tiles = camera.missing_tiles,
                         .exposure_value = camera.exposure_value};
    const auto found = std::ranges::find(files, camera.name, &CameraFileRecord::name);
    if (found != files.end()) {
      entry.dropped = found->dropped;
      entry.beyond_limit = found->beyond_limit;
      entry.last_file = found->last_file;
      entry.last_time_ns = found->last_time_ns;
      if (found->last_time_ns && record.period_ns > 0)
        entry.last_tick = static_cast<std::uint64_t>(*found->last_time_ns / record.period_ns);
      if (!found->last_rgb.empty())
        entry.last_image_png = report_png(found->width, found->height, found->last_rgb);
      add_sentences(*found, record);
    }
    record.cameras.push_back(std::move(entry));
  }
}

}  // namespace hil::run
