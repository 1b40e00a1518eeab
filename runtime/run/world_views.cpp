#include "runtime/run/world_views.hpp"

#include <new>
#include <utility>

#include "runtime/modules/still_image.hpp"
#include "runtime/run/contributed_files.hpp"
#include "runtime/run/png_file.hpp"
#include "runtime/run/report_image.hpp"

namespace hil::run {
namespace {

glm::dvec3 point_of(const std::array<double, 3>& p_m) {
  return {p_m[0], p_m[1], p_m[2]};
}

modules::RecordedCamera camera_of(const config::WorldView& view, const modules::World& world) {
  const std::string caller = "view " + view.name.text;
  modules::RecordedCamera camera =
      modules::camera_looking_at(point_of(view.position_m), point_of(view.look_at_m));
  camera.name = view.name.text;
  if (view.carrier) {
    const rtstdb::EntityId carrier = world.entity_of(view.carrier->text, caller);
    camera.carrier_index = carrier.index;
    camera.carrier_generation = carrier.generation;
  }
  camera.width = view.width;
  camera.height = view.height;
  camera.field_of_view_rad = view.field_of_view_rad;
  camera.is_real_time = !view.is_path_traced;
  camera.samples = view.samples;
  camera.bounces = view.bounces;
  if (view.exposure_value) {
    camera.exposure_value = *view.exposure_value;
    camera.has_automatic_exposure = false;
  }
  std::vector<std::string> layers;
  for (const config::Word& layer : view.layers)
    layers.push_back(layer.text);
  if (!layers.empty()) camera.mask = world.mask_of(layers, caller);
  return camera;
}

/// The sentence of what is missing; empty: nothing.
std::string draw(const modules::RecordedCamera& camera, rtstdb::Database& database, std::int64_t time_ns,
                 const std::filesystem::path& folder, const std::atomic<bool>* stop, report::View& view) {
  const auto still = modules::take_still_image(database, camera, {}, time_ns, stop);
  if (!still && stop != nullptr && stop->load())
    return "the view " + camera.name + " is missing: the drawing was stopped";
  if (!still) return "the view " + camera.name + " could not be drawn: " + still.error().message;
  const modules::StillImage& image = still.value();
  view.exposure_value = image.exposure_value;
  view.in_daylight = image.is_in_daylight;
  view.lights_overflow = image.lights_overflow;
  view.incomplete_pixels = image.incomplete_pixels;
  view.image_png = report_png(image.width, image.height, image.rgb);
  const std::filesystem::path file = folder / ("view-" + camera.name + ".png");
  std::string fault =
      write_png({.width = image.width, .height = image.height, .pixels = PngImage::Rgb8{image.rgb}}, file);
  if (fault.empty()) view.file = (folder.filename() / file.filename()).string();
  return fault;
}

}  // namespace

std::vector<modules::RecordedCamera> cameras_of_views(const config::World& scenario,
                                                      const modules::World& world) {
  std::vector<modules::RecordedCamera> cameras;
  for (const config::WorldView& view : scenario.views)
    cameras.push_back(camera_of(view, world));
  return cameras;
}

std::vector<std::string> draw_views(std::span<const modules::RecordedCamera> views,
                                    rtstdb::Database& database, std::int64_t time_ns,
                                    const std::filesystem::path& run_folder, const std::atomic<bool>* stop,
                                    report::RunRecord& record) {
  if (views.empty()) return {};
  std::vector<std::string> faults;
  const std::filesystem::path folder = image_folder(run_folder);
  std::error_code error;
  std::filesystem::create_directories(folder, error);  // write_png says what is wrong with it
  for (const modules::RecordedCamera& camera : views) {
    report::View view{.name = camera.name, .time_ns = time_ns};
    try {
      if (std::string fault = draw(camera, database, time_ns, folder, stop, view); !fault.empty())
        faults.push_back(std::move(fault));
    } catch (const std::bad_alloc&) {
      // The report is written all the same.
      faults.push_back("the view " + camera.name + " does not fit into memory");
    }
    if (!view.image_png.empty()) record.views.push_back(std::move(view));
  }
  return faults;
}

}  // namespace hil::run
