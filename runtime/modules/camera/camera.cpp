// A camera, carried by a body or at rest in the world (paper, Render Query). A step takes one image, whose
// exposure begins at its release, or none (image_schedule.hpp). The outputs, an object list among them, are
// those of camera_ports.hpp, the files those of image_encoder.hpp.

#include <algorithm>
#include <bit>
#include <cstdio>
#include <limits>
#include <utility>

#include <hil/noise_seed.hpp>
#include <hil/numbers.hpp>
#include <hil/quantity.hpp>
#include <hil/world/world_module.hpp>

#include "runtime/modules/answer_digest.hpp"
#include "runtime/modules/camera/camera_options.hpp"
#include "runtime/modules/camera/camera_ports.hpp"
#include "runtime/modules/camera/image_encoder.hpp"
#include "runtime/modules/camera/image_schedule.hpp"
#include "runtime/modules/camera/visible_bodies.hpp"
#include "runtime/modules/camera/visible_share.hpp"
#include "runtime/modules/recorded_camera.hpp"

namespace hil::modules {
namespace {

/// "2.900 s"
std::string in_seconds(std::int64_t time_ns) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f s", static_cast<double>(time_ns) * 1e-9);
  return text;
}

class CameraModule final : public WorldModule {
 public:
  CameraModule(const config::Value& parameters, CameraOptions options, const TaskParameters& task);

  const WorldPorts& ports() const noexcept override { return ports_; }
  void configure(World& world, const Setup& setup) override;
  void step(WorldStep& context) noexcept override;
  void describe(std::vector<contribution::ModuleRecord>& records) const override {
    records.push_back(to_module_record(camera_));
  }
  void contribute(contribution::Contribution& report) const override;

 private:
  rtstdb::ImageOutputs outputs() const noexcept;
  RecordedCamera describe_camera() const;
  void take_image(WorldStep& context) noexcept;
  void hand_over(const rtstdb::Image& image, std::int64_t time_ns) noexcept;
  void list_objects(WorldStep& context, const rtstdb::Terms& terms, const rtstdb::Image& image) noexcept;
  void add_to_section(contribution::Contribution& report) const;
  bool choose_objects(WorldStep& context, const rtstdb::Terms& terms) noexcept;
  void write_objects(WorldStep& context, bool is_whole) const noexcept;

  const CameraOptions options_;
  const ImageSchedule schedule_;
  const WorldPorts ports_;
  std::string instance_;
  std::int64_t first_release_ns_ = 0, period_ns_ = 0, tick_ns_ = 0, visible_after_ns_ = 0;

  const World* world_ = nullptr;
  rtstdb::Database* database_ = nullptr;
  std::shared_ptr<ImageEncoder> encoder_;
  std::unique_ptr<FileStream> stream_;  ///< null: no files
  std::unique_ptr<rtstdb::ImageQuery> query_;
  std::unique_ptr<rtstdb::Transaction> transaction_;
  rtstdb::EntityId carrier_{};
  std::uint32_t mask_ = rtstdb::mask_all, object_mask_ = rtstdb::mask_all;
  RecordedCamera camera_;

  VisibleBodies bodies_;
  VisibleShare share_;
  std::unique_ptr<rtstdb::Transaction> rows_;
  CameraView view_{};
  std::vector<VisibleBody> objects_;
  std::vector<CoveredBody> covered_;  // those of objects_
  std::uint32_t object_count_ = 0;
  AnswerDigest digest_;

  std::int64_t last_image_ns_ = 0;
  std::uint64_t images_ = 0, missing_tiles_ = 0, incomplete_pixels_ = 0, images_beyond_lights_ = 0;
};

CameraModule::CameraModule(const config::Value& parameters, CameraOptions options, const TaskParameters& task)
    : options_(std::move(options)),
      schedule_(options_.images_hz, task.period_ns),
      ports_(camera_ports(parameters, options_)) {}

rtstdb::ImageOutputs CameraModule::outputs() const noexcept {
  const bool has_noise = options_.sensor.full_well_e > 0.0;
  return {.color = options_.has_images && has_noise,
          .srgb = options_.has_images && !has_noise,
          .depth = options_.depth_step_m > 0.0 || options_.objects > 0,
          .identity = options_.objects > 0};
}

/// Without its seed.
RecordedCamera CameraModule::describe_camera() const {
  const glm::dvec3& p_m = options_.mount_m;
  const glm::dquat& q = options_.rotation;
  return {.name = instance_,
          .carrier_index = carrier_.index,
          .carrier_generation = carrier_.generation,
          .position_m = {p_m.x, p_m.y, p_m.z},
          .rotation_wxyz = {q.w, q.x, q.y, q.z},
          .width = options_.width,
          .height = options_.height,
          .field_of_view_rad = options_.field_of_view_rad,
          .near_m = options_.near_m,
          .row_time_ns = options_.row_time_ns,
          .exposure_ns = options_.exposure_ns,
          .is_real_time = options_.is_real_time(),
          .has_mapped_shadows = options_.shadows == rtstdb::Shadows::mapped,
          .samples = options_.samples,
          .bounces = options_.bounces,
          .emitter_points = options_.emitter_points,
          .lobe_rays = options_.lobe_rays,
          .mask = mask_,
          .exposure_value = options_.sensor.exposure_value,
          .full_well_e = options_.sensor.full_well_e,
          .read_noise_e = options_.sensor.read_noise_e};
}

void CameraModule::configure(World& world, const Setup& setup) {
  const TaskParameters& task = setup.task;
  instance_ = task.instance;
  first_release_ns_ = task.offset_ns;
  period_ns_ = task.period_ns;
  tick_ns_ = task.tick_ns;
  visible_after_ns_ = task.visible_after_ns();
  const std::string caller = "module " + task.instance;
  world_ = &world;
  database_ = &world.database();
  if (!options_.carrier.empty()) carrier_ = world.entity_of(options_.carrier, caller);
  if (!options_.layers.empty()) mask_ = world.mask_of(options_.layers, caller);
  if (!options_.object_layers.empty()) object_mask_ = world.mask_of(options_.object_layers, caller);
  camera_ = describe_camera();
  camera_.seed = options_.seed.value_or(noise_seed(task.seed, task.instance));

  rtstdb::ImageQueryOptions image = image_options_of(camera_, outputs());
  image.late = options_.late;
  auto query = database_->prepare(image);
  if (!query) throw RefusedByDatabase(caller, query.error());
  query_ = std::move(query).value();
  transaction_ = database_->make_transaction({.max_queries = 1, .max_reads = 1});
  if (options_.objects > 0) {
    share_.prepare(*database_, task.instance + " shares", caller);
    rows_ = database_->make_transaction({.max_reads = VisibleBodies::max_bodies});
    objects_.reserve(options_.objects);
    covered_.reserve(options_.objects);
  }
  if (!options_.has_images && options_.depth_step_m == 0.0) return;
  encoder_ = std::make_shared<ImageEncoder>(ImageEncoderOptions{.name = task.instance,
                                                                .width = options_.width,
                                                                .height = options_.height,
                                                                .has_images = options_.has_images,
                                                                .depth_step_m = options_.depth_step_m,
                                                                .sensor = sensor_of(camera_),
                                                                .tick_ns = task.tick_ns});
  stream_ = setup.files.open({.folder = "images",
                              .owner = "camera " + task.instance,
                              .singular = "image",
                              .plural = "images",
                              .buffer_bytes = encoder_->buffer_bytes(),
                              .max_bytes = options_.max_bytes,
                              .encoder = encoder_});
}

void CameraModule::step(WorldStep& context) noexcept {
  const auto release = static_cast<std::uint64_t>((context.time_ns - first_release_ns_) / period_ns_);
  if (schedule_.image_of(release)) take_image(context);
  const std::int64_t seen_ns = context.time_ns + visible_after_ns_;
  context.outputs[CameraOutputs::age()] = images_ == 0 ? std::numeric_limits<double>::quiet_NaN()
                                                       : static_cast<double>(seen_ns - last_image_ns_) * 1e-6;
}

void CameraModule::take_image(WorldStep& context) noexcept {
  const rtstdb::Terms terms{.deadline_class = context.read_class,
                            .deadline = context.deadline,
                            .importance = 1,
                            .world_time = {},
                            .read_at = rtstdb::ReadAt::pinned(context.version)};
  view_ = {.camera = camera_at(camera_, context.time_ns), .width = options_.width, .height = options_.height};
  query_->cameras()[0] = view_.camera;
  transaction_->begin(terms);
  if (carrier_.valid()) transaction_->read(carrier_);
  transaction_->add_query(*query_, 1);
  if (!context.execute(*database_, *transaction_).done()) return;
  if (carrier_.valid()) {
    const rtstdb::EntityState* const carrier = transaction_->state(0);
    if (carrier == nullptr) return;
    view_.carrier = carrier->row.motion;
  }
  const rtstdb::Image& image = std::as_const(*query_).images()[0];
  last_image_ns_ = context.time_ns;
  context.outputs[CameraOutputs::image_count()] = static_cast<double>(++images_);
  context.outputs[CameraOutputs::missing_tiles()] = static_cast<double>(image.missing_tiles.size());
  missing_tiles_ += image.missing_tiles.size();
  incomplete_pixels_ += image.incomplete_pixels;
  images_beyond_lights_ += image.lights_overflow ? 1 : 0;
  if (stream_) hand_over(image, context.time_ns);
  if (options_.objects > 0) list_objects(context, terms, image);
}

void CameraModule::hand_over(const rtstdb::Image& image, std::int64_t time_ns) noexcept {
  const std::span<std::byte> buffer = stream_->begin();
  if (buffer.empty()) return;
  const ImageBuffer parts = encoder_->parts_of(buffer);
  if (!parts.color.empty()) std::ranges::copy(image.color, parts.color.begin());
  if (!parts.srgb.empty()) std::ranges::copy(image.srgb, parts.srgb.begin());
  if (!parts.depth_m.empty()) std::ranges::copy(image.depth_m, parts.depth_m.begin());
  stream_->finish(buffer.size(), time_ns);
}

void CameraModule::list_objects(WorldStep& context, const rtstdb::Terms& terms,
                                const rtstdb::Image& image) noexcept {
  for (std::size_t pixel = 0; pixel < image.entities.size(); ++pixel) {
    digest_.add(image.entities[pixel].index);
    digest_.add(std::bit_cast<std::uint32_t>(image.depth_m[pixel]));
  }
  context.outputs[CameraOutputs::digest()] = digest_.number();
  bodies_.find(options_.width, image.entities, image.depth_m);
  if (!choose_objects(context, terms)) return;
  share_.count(context, terms, view_, image, covered_);
  write_objects(context, image.missing_tiles.empty());
}

/// The nearest bodies of the object layers. False: their rows could not be read.
bool CameraModule::choose_objects(WorldStep& context, const rtstdb::Terms& terms) noexcept {
  const std::span<const VisibleBody> bodies = bodies_.nearest_first();
  objects_.clear();
  covered_.clear();
  object_count_ = 0;
  if (bodies.empty()) return true;
  rows_->begin(terms);
  for (const VisibleBody& body : bodies)
    rows_->read(body.entity);
  if (!context.execute(*database_, *rows_).done()) return false;
  for (std::uint32_t i = 0; i < bodies.size(); ++i) {
    const rtstdb::EntityState* const state = rows_->state(i);
    if (state == nullptr || (state->row.mask & object_mask_) == 0) continue;
    ++object_count_;
    if (objects_.size() == options_.objects) continue;
    const rtstdb::Bounds bounds = world_->bounds_of(bodies[i].entity);
    const glm::dvec3 low(bounds.minimum_m), high(bounds.maximum_m);
    objects_.push_back(bodies[i]);
    covered_.push_back({.entity = bodies[i].entity,
                        .box = {.motion = state->row.motion,
                                .center_m = 0.5 * (low + high) * state->row.scale,
                                .half_m = 0.5 * (high - low) * state->row.scale}});
  }
  return true;
}

void CameraModule::write_objects(WorldStep& context, bool is_whole) const noexcept {
  context.outputs[CameraOutputs::object_count()] = static_cast<double>(object_count_);
  for (std::size_t i = 0; i < options_.objects; ++i) {
    const auto slot = context.outputs.subspan(CameraOutputs::object(i), CameraOutputs::per_object);
    if (i >= objects_.size()) {
      std::ranges::fill(slot, 0.0);
      continue;
    }
    const VisibleBody& body = objects_[i];
    const double covered = static_cast<double>(body.pixels) + static_cast<double>(covered_[i].hidden);
    const std::array<double, CameraOutputs::per_object> values{
        1.0,
        static_cast<double>(body.entity.index),
        static_cast<double>(body.x_min),
        static_cast<double>(body.y_min),
        static_cast<double>(body.x_max),
        static_cast<double>(body.y_max),
        static_cast<double>(body.depth_m),
        static_cast<double>(body.pixels),
        static_cast<double>(body.pixels) / covered,
        is_whole && covered_[i].undecided == 0 ? 1.0 : 0.0};
    std::ranges::copy(values, slot.begin());
  }
}

/// A record in the list `cameras`; on the page a row in the table of all cameras, and the last image.
void CameraModule::add_to_section(contribution::Contribution& report) const {
  using contribution::Cell;
  const FileStreamRecord files = stream_ ? stream_->record() : FileStreamRecord{};
  const auto last_tick = files.last_time_ns ? std::optional(*files.last_time_ns / tick_ns_) : std::nullopt;
  const auto count = [](std::uint64_t number) { return static_cast<std::int64_t>(number); };
  const auto or_null = [](std::optional<std::int64_t> number) {
    return number ? contribution::Property{{}, *number} : contribution::Property{{}, contribution::not_known};
  };
  const double exposure_value = options_.sensor.exposure_value;
  report.lists.push_back({.list = camera_list,
                          .name = instance_,
                          .properties = {{"images", count(images_)},
                                         {"dropped", count(files.dropped)},
                                         {"beyond_limit", count(files.beyond_limit)},
                                         {"missing_tiles", count(missing_tiles_)},
                                         {"exposure_value", exposure_value},
                                         {"last_file", files.last_file},
                                         {"last_time_ns", or_null(files.last_time_ns).value},
                                         {"last_tick", or_null(last_tick).value}}});

  contribution::Section& section = report.section("Cameras");
  section.name = "cameras";
  if (encoder_ && !encoder_->last_rgb().empty())
    section.images.push_back({.title = instance_,
                              .caption = "Tick " + std::to_string(*last_tick) + ", " +
                                         in_seconds(*files.last_time_ns) + ". Exposure value " +
                                         config::format_number(exposure_value) + ", " + files.last_file + ".",
                              .width = options_.width,
                              .height = options_.height,
                              .rgb = encoder_->last_rgb()});
  if (section.tables.empty())
    section.tables.push_back({.columns = {{.title = "Camera"},
                                          {.title = "Images", .numeric = true},
                                          {.title = "Dropped", .numeric = true},
                                          {.title = "Beyond max_size", .numeric = true},
                                          {.title = "Missing tiles", .numeric = true},
                                          {.title = "Last file"}}});
  const auto number = [](std::uint64_t value) { return Cell{.number = static_cast<double>(value)}; };
  const auto fault = [&](std::uint64_t value) {
    Cell cell = number(value);
    if (value > 0) cell.mark = contribution::Mark::bad;
    return cell;
  };
  section.tables.front().rows.push_back({{.text = instance_},
                                         number(images_),
                                         fault(files.dropped),
                                         number(files.beyond_limit),
                                         fault(missing_tiles_),
                                         {.text = files.last_file}});
}

void CameraModule::contribute(contribution::Contribution& report) const {
  add_to_section(report);
  const std::string camera = "camera " + instance_ + ": ";
  const auto note = [&](std::int64_t time_ns, const std::string& text) {
    report.events.push_back({time_ns, camera + text});
  };
  if (!schedule_.is_even())
    note(first_release_ns_,
         "the time between images is " + config::format_number(schedule_.releases_per_image()) +
             " periods of the task, no whole number; each is taken at the nearest release");
  if (options_.objects > 0 && options_.readout_ns() > visible_after_ns_)
    note(first_release_ns_, "the object list is visible " + config::format_duration(visible_after_ns_) +
                                " after the release, before the exposure of the image ends after " +
                                config::format_duration(options_.readout_ns()) +
                                "; for a device under test the task needs a 'thread' and a later 'deadline'");
  if (options_.shadows == rtstdb::Shadows::mapped && !database_->device().draws)
    note(first_release_ns_,
         "the device can not draw shadow maps: shadows are traced, and lamps and the sun do not light what "
         "rough surfaces reflect");
  if (bodies_.ignored_pixels() > 0)
    note(report.end_ns, std::to_string(bodies_.ignored_pixels()) +
                            " pixels are in no object: images show "
                            "more than " +
                            std::to_string(VisibleBodies::max_bodies) + " bodies");
  if (incomplete_pixels_ > 0)
    note(report.end_ns,
         std::to_string(incomplete_pixels_) +
             " pixels lack light or show nothing, since a search reached a limit of the device");
  if (images_beyond_lights_ > 0)
    note(report.end_ns, std::to_string(images_beyond_lights_) +
                            " images lack light: the world has more lights than an image may have");
}

}  // namespace

ModuleType camera_type() {
  return {.name = "camera",
          .about = "A camera, carried by a body or at rest: images, depths, and a list of visible bodies.",
          .parameters = camera_schema(),
          .create = [](const config::Value& values, const TaskParameters& task,
                       config::Diagnostics& diagnostics) -> std::unique_ptr<AnyModule> {
            auto options = read_camera_options(values, task.period_ns, diagnostics);
            if (!options) return nullptr;
            return std::make_unique<CameraModule>(values, std::move(*options), task);
          }};
}

}  // namespace hil::modules
