#pragma once
// `hil history DIR image`: the camera that its options describe, and the files of its images.
//
// Threads: one; allocates and writes files.

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
  std::vector<double> size;               ///< empty: the camera's
  std::string field_of_view, mode;        ///< empty: the camera's
  std::optional<double> samples, bounces, exposure_value;
  std::string file, depth_file, depth_step;  ///< empty: not given
};

void add_image_options(CLI::App* command, ImageArguments& arguments);

/// Throws HistoryError (question) for files that are no PNG files or lie in the folder of the run, and for
/// options of files that contradict each other.
void check_image_files(const ImageArguments& arguments, const std::string& directory);

/// Throws HistoryError (question) for options that contradict each other, and for a camera, a carrier or a
/// layer that the run does not have.
modules::RecordedCamera camera_of(const ImageArguments& arguments, const std::string& carrier,
                                  const std::vector<std::string>& layers, const history::RunHistory& history);

struct ImageFileNames {
  std::string color, depth;  ///< empty: not wanted
};
/// The files of the image at index `index` of a series: "street.png", or "street-0003.png" in a series.
ImageFileNames image_file_names(const ImageArguments& arguments, std::size_t index, bool is_series);
/// Throws HistoryError (file).
void write_image(const modules::StillImage& image, const ImageArguments& arguments,
                 const ImageFileNames& files);

}  // namespace hil::cli
