// A laser scanner with one turning beam, carried by a body (paper, Section 6). Every beam has its own time
// and meets bodies where they are at that time. Each step queries the beams that leave in the period after
// its release. The outputs are an object list.
//
// The first sweep begins with the task's first release, so a sweep is a whole number of steps.
//
// Outputs  object<i>.valid, .x, .y (m), .vx, .vy (m/s over ground), .length (m), .age (ms): objects in the
//          carrier's axes at the instant they were measured, `age` ago; the origin is list_origin
//          object_count, scan_index, hits (beams of the last step that hit), digest (a hash of all answers so
//          far: runs with equal digests have equal answers)

#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <bit>
#include <cmath>

#include <rtstdb/limits.hpp>

#include "runtime/config/numbers.hpp"
#include "runtime/modules/laser_scanner/comparison_section.hpp"
#include "runtime/modules/laser_scanner/object_list.hpp"
#include "runtime/modules/laser_scanner/recorded_laser_scanner.hpp"
#include "runtime/modules/laser_scanner/scanner_options.hpp"
#include "runtime/modules/laser_scanner/scanner_record.hpp"
#include "runtime/modules/laser_scanner/sweep_comparison.hpp"
#include "runtime/modules/module.hpp"

namespace hil::modules {
namespace {

constexpr std::size_t outputs_per_object = 7;
constexpr std::size_t max_view_points = 4000;

/// FNV-1a over words: the same on every machine.
class Digest {
 public:
  void add(std::uint32_t word) noexcept { value_ = (value_ ^ word) * 0x100000001B3ull; }
  /// As a number that a double holds exactly.
  double number() const noexcept { return static_cast<double>(value_ >> 11); }

 private:
  std::uint64_t value_ = 0xCBF29CE484222325ull;
};

class LaserScanner final : public Module {
 public:
  explicit LaserScanner(const config::Value& parameters);

  const Ports& ports() const noexcept override { return ports_; }
  void check_task(const config::Value& parameters, const TaskParameters& task,
                  config::Diagnostics& diagnostics) const override;
  void configure(World& world, EventLog& events, const TaskParameters& task) override;
  void describe(std::vector<contribution::ModuleRecord>& records) const override;
  void step(StepContext& context) noexcept override;
  void contribute(contribution::Contribution& report) const override;

 private:
  std::uint64_t max_beams_per_step(std::int64_t step_ns) const noexcept;
  void fill_rays() noexcept;
  void begin_sweep(const StepContext& context) noexcept;
  void take_hits(StepContext& context, const rtstdb::Motion& carrier) noexcept;
  void write_outputs(StepContext& context, const rtstdb::Motion& carrier) noexcept;
  void keep_view_point(const rtstdb::RayHit& hit, const glm::dvec3& p_world_m, std::uint64_t beam) noexcept;

  const ScannerOptions options_;
  ScanPattern pattern_;
  ObjectList objects_;
  Ports ports_;

  rtstdb::Database* database_ = nullptr;
  std::unique_ptr<rtstdb::RayQuery> moving_, still_;
  std::unique_ptr<rtstdb::Transaction> transaction_, still_transaction_;
  rtstdb::EntityId carrier_;
  std::uint32_t mask_ = 0, object_mask_ = 0;
  std::optional<SweepComparison> comparison_;
  std::vector<std::optional<BodyMotion>> compared_motion_;

  std::string instance_;
  std::int64_t step_ns_ = 0;
  std::int64_t first_release_ns_ = 0;  // sweeps begin there and every period after
  // The slice of this step: beams [first_beam_, end_beam_) of the sweep that began at sweep_begin_ns_.
  std::int64_t sweep_begin_ns_ = 0;
  std::uint64_t first_beam_ = 0, end_beam_ = 0;
  rtstdb::Version sweep_version_ = 0;
  std::uint64_t sweeps_ = 0;
  bool begun_ = false;     // a slice of this sweep has answers
  bool complete_ = false;  // all its slices so far have
  Digest digest_;

  std::uint64_t view_every_ = 1;
  std::vector<contribution::SensorPoint> view_, last_view_;
  rtstdb::Motion last_carrier_;
};

LaserScanner::LaserScanner(const config::Value& parameters)
    : options_(read_scanner_options(parameters)),
      pattern_(options_.pattern),
      objects_({.max_objects = options_.max_objects, .keep_ns = options_.keep_ns}) {
  const auto note = [&](const char* key, std::vector<config::Word>& words) {
    for (const config::Value& item : parameters[key].items())
      words.push_back({item.text(), item.place()});
  };
  note("layers", ports_.layers);
  note("object_layers", ports_.layers);
  ports_.bodies.push_back({options_.carrier, parameters["carrier"].place()});
  note("compare", ports_.bodies);
  for (std::uint32_t i = 0; i < options_.max_objects; ++i) {
    const std::string object = "object" + std::to_string(i);
    ports_.outputs.push_back({.name = object + ".valid", .unit = "", .about = "1: the slot holds an object"});
    ports_.outputs.push_back(
        {.name = object + ".x", .unit = "m", .about = "Centre, ahead of the list's origin"});
    ports_.outputs.push_back(
        {.name = object + ".y", .unit = "m", .about = "Centre, left of the list's origin"});
    ports_.outputs.push_back(
        {.name = object + ".vx", .unit = "m/s", .about = "Over ground, along the carrier's x"});
    ports_.outputs.push_back(
        {.name = object + ".vy", .unit = "m/s", .about = "Over ground, along the carrier's y"});
    ports_.outputs.push_back(
        {.name = object + ".length", .unit = "m", .about = "Measured, along its velocity"});
    ports_.outputs.push_back({.name = object + ".age", .unit = "ms", .about = "Time since it was measured"});
  }
  ports_.outputs.push_back({.name = "object_count", .unit = "", .about = "Slots that hold an object"});
  ports_.outputs.push_back({.name = "scan_index", .unit = "", .about = "Sweeps begun before this one"});
  ports_.outputs.push_back({.name = "hits", .unit = "", .about = "Beams of the last step that hit a body"});
  ports_.outputs.push_back({.name = "digest", .unit = "", .about = "Hash of all answers so far"});
  view_every_ = (pattern_.beams() + max_view_points - 1) / max_view_points;
}

std::uint64_t LaserScanner::max_beams_per_step(std::int64_t step_ns) const noexcept {
  std::uint64_t max_beams = 0;
  for (std::int64_t t_ns = 0; t_ns < options_.pattern.period_ns; t_ns += step_ns)
    max_beams = std::max(max_beams, pattern_.first_beam_at(t_ns + step_ns) - pattern_.first_beam_at(t_ns));
  return max_beams;
}

void LaserScanner::check_task(const config::Value& parameters, const TaskParameters& task,
                              config::Diagnostics& diagnostics) const {
  const std::int64_t sweep_ns = options_.pattern.period_ns;
  if (sweep_ns % task.period_ns != 0) {
    const auto rate_of = [&](std::int64_t steps) {
      const double sweep_s = static_cast<double>(steps * task.period_ns) * 1e-9;
      return config::format_number(1.0 / sweep_s) + " Hz";
    };
    const std::int64_t fewer = sweep_ns / task.period_ns;
    diagnostics.add(parameters["scan_rate"].place(),
                    "'scan_rate': a sweep of " + std::to_string(sweep_ns) +
                        " ns is not a whole number of the task's periods of " +
                        std::to_string(task.period_ns) + " ns; with " +
                        (fewer > 0 ? rate_of(fewer) + " or " : "") + rate_of(fewer + 1) + " it is");
    return;
  }
  const std::uint64_t beams = max_beams_per_step(task.period_ns);
  if (beams > rtstdb::max_rays_per_query) {
    diagnostics.add(parameters["columns"].place(),
                    "a sweep of " + std::to_string(pattern_.beams()) + " beams has " + std::to_string(beams) +
                        " in a step of the task; at most " + std::to_string(rtstdb::max_rays_per_query) +
                        " are possible: use fewer beams or a faster task");
  }
  if (!options_.ignore_motion && task.period_ns > rtstdb::max_query_window_ns) {
    diagnostics.add(parameters["scan_rate"].place(),
                    "the beams of a step leave within the task's period of " +
                        std::to_string(task.period_ns) + " ns; at most " +
                        std::to_string(rtstdb::max_query_window_ns) + " ns are possible: use a faster task");
  }
}

void LaserScanner::configure(World& world, EventLog& /*events*/, const TaskParameters& task) {
  instance_ = task.instance;
  step_ns_ = task.period_ns;
  first_release_ns_ = task.offset_ns;
  const std::string caller = "module " + task.instance;
  database_ = &world.database();
  carrier_ = world.entity_of(options_.carrier, caller);
  mask_ = world.mask_of(options_.layers, caller);
  object_mask_ = world.mask_of(options_.object_layers, caller);
  std::vector<ComparedBody> compared;
  for (const std::string& name : options_.compare) {
    const rtstdb::EntityId entity = world.entity_of(name, caller);
    const rtstdb::Bounds bounds = world.bounds_of(entity);
    compared.push_back(
        {name, entity, bounds.maximum_m.x - bounds.minimum_m.x, bounds.maximum_m.y - bounds.minimum_m.y});
  }
  compared_motion_.resize(compared.size());

  const std::uint64_t max_beams = max_beams_per_step(task.period_ns);
  const auto prepare = [&](const char* suffix, bool ignore_motion) {
    auto query = database_->prepare(
        rtstdb::RayQueryOptions{.name = task.instance + suffix,
                                .capacity = static_cast<std::uint32_t>(std::max<std::uint64_t>(max_beams, 1)),
                                .mode = rtstdb::RayMode::closest,
                                .ignore_motion = ignore_motion});
    if (!query) throw SetupError(caller, query.error());
    return std::move(query).value();
  };
  moving_ = prepare("", options_.ignore_motion);
  const auto reads = static_cast<std::uint32_t>(1 + compared.size());
  transaction_ = database_->make_transaction({.max_queries = 1, .max_reads = reads});
  if (!compared.empty()) {
    still_ = prepare(" without motion", true);
    still_transaction_ = database_->make_transaction({.max_queries = 1});
    comparison_.emplace(pattern_, std::move(compared));
  }
  view_.reserve(max_view_points + 1);
  last_view_.reserve(max_view_points + 1);
}

void LaserScanner::fill_rays() noexcept {
  const auto fill = [&](rtstdb::RayQuery& query) {
    const auto rays = query.rays();
    for (std::uint64_t beam = first_beam_; beam < end_beam_; ++beam) {
      rtstdb::Ray& ray = rays[beam - first_beam_];
      ray.origin_m = glm::vec3(options_.mount_m);
      ray.direction = pattern_.direction(pattern_.column_of(beam), pattern_.row_of(beam));
      ray.lambda_min = 0.0f;
      ray.lambda_max = static_cast<float>(options_.range_m);
      ray.t = rtstdb::world_time_ns(sweep_begin_ns_ + pattern_.time_ns(beam));
      ray.mask = mask_;
      ray.carrier = carrier_;
    }
  };
  fill(*moving_);
  if (still_) fill(*still_);
}

/// At the first slice of a sweep that has answers: takes the motions of the compared bodies.
void LaserScanner::begin_sweep(const StepContext& context) noexcept {
  view_.swap(last_view_);
  view_.clear();
  if (!comparison_) return;
  const auto motion_at_begin = [&](const rtstdb::EntityState& state) {
    return rtstdb::rebased(state.row.motion, context.world_time());
  };
  const rtstdb::Motion carrier = motion_at_begin(*transaction_->state(0));
  const glm::dvec3 forward = carrier.q_world * glm::dvec3(1.0, 0.0, 0.0);
  const glm::dvec3 sensor = carrier.p_world_m + carrier.q_world * options_.mount_m;
  for (std::size_t i = 0; i < compared_motion_.size(); ++i) {
    compared_motion_[i].reset();
    const rtstdb::EntityState* state = transaction_->state(static_cast<std::uint32_t>(i + 1));
    if (state == nullptr) continue;
    const rtstdb::Motion motion = motion_at_begin(*state);
    const glm::dvec3 ahead = motion.q_world * glm::dvec3(1.0, 0.0, 0.0);
    compared_motion_[i] = BodyMotion{.center = {glm::dvec2(motion.p_world_m), glm::dvec2(motion.v_world_mps)},
                                     .heading_rad = std::atan2(ahead.y, ahead.x)};
  }
  comparison_->begin_sweep(sweep_begin_ns_,
                           {.point = {glm::dvec2(sensor), glm::dvec2(carrier.v_world_mps)},
                            .heading_rad = std::atan2(forward.y, forward.x)},
                           compared_motion_);
}

void LaserScanner::keep_view_point(const rtstdb::RayHit& hit, const glm::dvec3& p_world_m,
                                   std::uint64_t beam) noexcept {
  if (beam % view_every_ != 0 || view_.size() == view_.capacity()) return;
  view_.push_back({p_world_m.x, p_world_m.y, p_world_m.z, pattern_.azimuth_rad(pattern_.column_of(beam)),
                   pattern_.elevation_rad(pattern_.row_of(beam)), hit.lambda, hit.entity.index});
}

void LaserScanner::take_hits(StepContext& context, const rtstdb::Motion& carrier) noexcept {
  const auto hits = moving_->hits();
  double hit_count = 0.0;
  for (std::uint64_t beam = first_beam_; beam < end_beam_; ++beam) {
    const rtstdb::RayHit& hit = hits[beam - first_beam_];
    digest_.add(static_cast<std::uint32_t>(hit.status));
    if (hit.status != rtstdb::HitStatus::hit) continue;
    digest_.add(std::bit_cast<std::uint32_t>(hit.lambda));
    digest_.add(hit.entity.index);
    digest_.add(hit.triangle);
    hit_count += 1.0;
    const std::uint32_t column = pattern_.column_of(beam);
    const std::int64_t beam_ns = sweep_begin_ns_ + pattern_.time_ns(beam);
    const rtstdb::Pose pose = rtstdb::pose_at(carrier, rtstdb::world_time_ns(beam_ns));
    const glm::dvec3 in_carrier =
        options_.mount_m +
        glm::dvec3(pattern_.direction(column, pattern_.row_of(beam))) * static_cast<double>(hit.lambda);
    const glm::dvec3 p_world_m = pose.p_world_m + pose.q_world * in_carrier;
    keep_view_point(hit, p_world_m, beam);
    if (comparison_) comparison_->add_hit(hit, column, pattern_.row_of(beam), false);
    if ((hit.mask & object_mask_) == 0) continue;
    // The carrier's rotation adds a negligible velocity.
    const glm::dvec3 v_world = glm::dvec3(hit.v_relative_mps) + carrier.v_world_mps;
    objects_.add(hit.entity, column, beam_ns, p_world_m, v_world);
  }
  if (comparison_ && still_transaction_->outcome().done()) {
    const auto still_hits = still_->hits();
    for (std::uint64_t beam = first_beam_; beam < end_beam_; ++beam) {
      const rtstdb::RayHit& hit = still_hits[beam - first_beam_];
      if (hit.status != rtstdb::HitStatus::hit) continue;
      comparison_->add_hit(hit, pattern_.column_of(beam), pattern_.row_of(beam), true);
    }
  }
  context.outputs[options_.max_objects * outputs_per_object + 2] = hit_count;
}

void LaserScanner::step(StepContext& context) noexcept {
  const std::int64_t offset_ns = (context.time_ns - first_release_ns_) % options_.pattern.period_ns;
  first_beam_ = pattern_.first_beam_at(offset_ns);
  if (sweeps_ == 0 || context.time_ns - offset_ns != sweep_begin_ns_) {
    sweep_begin_ns_ = context.time_ns - offset_ns;
    sweep_version_ = context.version;
    ++sweeps_;
    begun_ = false;
    complete_ = offset_ns == 0;
  } else if (first_beam_ != end_beam_) {
    complete_ = false;  // releases were skipped
  }
  end_beam_ = pattern_.first_beam_at(offset_ns + context.period_ns);
  const auto count = static_cast<std::uint32_t>(end_beam_ - first_beam_);
  fill_rays();
  rtstdb::Terms terms{
      .deadline_class = rtstdb::DeadlineClass::soft,
      .deadline = context.deadline,
      .importance = 1,
      .world_time = {},
      .read_at = rtstdb::ReadAt::pinned(options_.ignore_motion ? sweep_version_ : context.version)};
  transaction_->begin(terms);
  transaction_->read(carrier_);
  if (comparison_) {
    for (const ComparedBody& body : comparison_->bodies())
      transaction_->read(body.entity);
  }
  transaction_->add_query(*moving_, count);
  if (!context.execute(*database_, *transaction_).done() || transaction_->state(0) == nullptr) {
    complete_ = false;
    return;
  }
  if (still_) {
    terms.read_at = rtstdb::ReadAt::pinned(sweep_version_);
    still_transaction_->begin(terms);
    still_transaction_->add_query(*still_, count);
    if (!context.execute(*database_, *still_transaction_).done()) complete_ = false;
  }
  last_carrier_ = transaction_->state(0)->row.motion;
  const std::int64_t end_ns = context.time_ns + context.period_ns;
  const glm::dvec3 near_m = rtstdb::pose_at(last_carrier_, rtstdb::world_time_ns(end_ns)).p_world_m;
  if (!begun_) {
    objects_.end_sweep(context.time_ns, near_m);  // of the sweep before, if its end was skipped
    begin_sweep(context);
    begun_ = true;
  }
  take_hits(context, last_carrier_);

  if (count > 0) objects_.advance(pattern_.column_of(end_beam_ - 1), end_ns, near_m);
  if (end_beam_ == pattern_.beams()) {
    objects_.end_sweep(end_ns, near_m);
    if (comparison_ && complete_) comparison_->end_sweep();
  }
  objects_.forget(end_ns);
  write_outputs(context, last_carrier_);
}

void LaserScanner::write_outputs(StepContext& context, const rtstdb::Motion& carrier) noexcept {
  // The outputs become visible at the deadline, so the age counts until then.
  const std::int64_t seen_ns = context.time_ns + context.period_ns;
  double count = 0.0;
  std::size_t out = 0;
  for (const ScannedObject& object : objects_.slots()) {
    if (!object.entity.valid()) {
      std::fill_n(context.outputs.begin() + static_cast<std::ptrdiff_t>(out), outputs_per_object, 0.0);
      out += outputs_per_object;
      continue;
    }
    count += 1.0;
    const rtstdb::Pose pose = rtstdb::pose_at(carrier, rtstdb::world_time_ns(object.time_ns));
    const glm::dquat to_carrier = glm::conjugate(pose.q_world);
    const glm::dvec3 at = to_carrier * (object.center_m - pose.p_world_m) - options_.list_origin_m;
    const glm::dvec3 v = to_carrier * object.velocity_mps;
    const double values[outputs_per_object] = {
        1.0, at.x, at.y, v.x, v.y, object.length_m, static_cast<double>(seen_ns - object.time_ns) * 1e-6};
    for (const double value : values)
      context.outputs[out++] = value;
  }
  context.outputs[out] = count;
  context.outputs[out + 1] = static_cast<double>(sweeps_ - 1);
  context.outputs[out + 3] = digest_.number();
}

void LaserScanner::describe(std::vector<contribution::ModuleRecord>& records) const {
  const PatternOptions& pattern = options_.pattern;
  records.push_back(to_module_record({.name = instance_,
                                      .carrier_index = carrier_.index,
                                      .carrier_generation = carrier_.generation,
                                      .mount_m = {options_.mount_m.x, options_.mount_m.y, options_.mount_m.z},
                                      .columns = pattern.columns,
                                      .rows = pattern.rows,
                                      .horizontal_rad = pattern.horizontal_rad,
                                      .vertical_rad = pattern.vertical_rad,
                                      .elevation_rad = pattern.elevation_rad,
                                      .left_to_right = pattern.left_to_right,
                                      .range_m = options_.range_m,
                                      .mask = mask_,
                                      .ignore_motion = options_.ignore_motion,
                                      .first_sweep_ns = first_release_ns_,
                                      .sweep_ns = pattern.period_ns,
                                      .step_ns = step_ns_}));
}

void LaserScanner::contribute(contribution::Contribution& report) const {
  if (comparison_) contribute_comparison(*comparison_, report);
  if (objects_.ignored_hits() > 0) {
    report.events.push_back(
        {report.end_ns,
         std::to_string(objects_.ignored_hits()) +
             " hits are in no object: more bodies were in view at once than the object list can follow"});
  }
  if (sweeps_ == 0) return;
  report.map.sensor_points = last_view_.empty() ? view_ : last_view_;
  const rtstdb::Pose pose = rtstdb::pose_at(last_carrier_, rtstdb::world_time_ns(report.end_ns));
  const glm::dvec3 sensor = pose.p_world_m + pose.q_world * options_.mount_m;
  const glm::dvec3 forward = pose.q_world * glm::dvec3(1.0, 0.0, 0.0);
  const double heading = std::atan2(forward.y, forward.x);
  const double half = 0.5 * options_.pattern.horizontal_rad;
  const double first = options_.pattern.left_to_right ? half : -half;
  report.map.field_of_view = contribution::FieldOfView{.origin = {sensor.x, sensor.y},
                                                       .first_direction_rad = heading + first,
                                                       .last_direction_rad = heading - first,
                                                       .range_m = options_.range_m};
}

}  // namespace

ModuleType laser_scanner_type() {
  return {
      .name = "laser_scanner",
      .about = "A laser scanner with one turning beam, carried by a body.",
      .parameters = scanner_schema(),
      .create = [](const config::Value& values, config::Diagnostics& diagnostics) -> std::unique_ptr<Module> {
        const std::string& carrier = values["carrier"].text();
        for (const config::Value& body : values["compare"].items()) {
          if (body.text() != carrier) continue;
          diagnostics.add(body.place(), "'compare': " + config::in_quotes(carrier) +
                                            " carries the scanner, so its beams do not sweep over it");
          return nullptr;
        }
        return std::make_unique<LaserScanner>(values);
      },
      .recorded_list = scanner_list,
      .make_recorded_scanner = recorded_laser_scanner};
}

}  // namespace hil::modules
