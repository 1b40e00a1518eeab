#pragma once
// `hil history DIR image`: the camera that its options describe, and the files of its images.

#include <CLI/CLI.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "runtime/history/run_history.hpp"
#include "runtime/modules/still_image.hpp"

namespace hil::cli {

struct ImageArguments {
  std::string camera;                     ///< of the run; empty: one at `position`
  std::vector<double> position, look_at;  ///< in metres; empty: not given
  std::vector<std::uint32_t> size;        ///< empty: the camera's
  std::string field_of_view, mode;        ///< empty: the camera's
  std::optional<std::uint32_t> samples, bounces;
  std::optional<double> exposure_value;
  std::string file, depth_file, depth_step = "1mm";
};

void add_image_options(CLI::App* command, ImageArguments& arguments);

/// Throws HistoryError (question) for options that contradict each other, and for a camera, a carrier or a
/// layer that the run does not have.
modules::RecordedCamera camera_of(const ImageArguments& arguments, const std::string& carrier,
                                  const std::vector<std::string>& layers, const history::RunHistory& history);

struct ImageFiles {
  std::string color, depth;  ///< empty: not wanted
};
/// The files of the image at index `index` of a series: "street.png", or "street-0003.png" in a series.
ImageFiles image_files(const ImageArguments& arguments, std::size_t index, bool is_series);
/// Throws HistoryError (file).
void write(const modules::StillImage& image, const ImageArguments& arguments, const ImageFiles& files);

}  // namespace hil::cli
