// A laser scanner with one turning beam, carried by a body (paper, Section 6). Every beam has its own time
// and meets bodies where they are at that time. Each step queries the beams that leave in the period after
// its release. The outputs, an object list and targets, are those of scanner_ports.hpp.
//
// The first sweep begins with the task's first release, so a sweep is a whole number of steps.

#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <bit>
#include <cmath>

#include <hil/noise_seed.hpp>
#include <hil/world/beam_query.hpp>
#include <hil/world/receiver.hpp>
#include <hil/world/world_module.hpp>

#include "runtime/modules/answer_digest.hpp"
#include "runtime/modules/laser_scanner/comparison_section.hpp"
#include "runtime/modules/laser_scanner/object_list.hpp"
#include "runtime/modules/laser_scanner/recorded_laser_scanner.hpp"
#include "runtime/modules/laser_scanner/return_statistics.hpp"
#include "runtime/modules/laser_scanner/scanner_options.hpp"
#include "runtime/modules/laser_scanner/scanner_ports.hpp"
#include "runtime/modules/laser_scanner/scanner_record.hpp"
#include "runtime/modules/laser_scanner/sweep_clock.hpp"
#include "runtime/modules/laser_scanner/sweep_cloud.hpp"
#include "runtime/modules/laser_scanner/sweep_comparison.hpp"
#include "runtime/modules/laser_scanner/sweep_view.hpp"
#include "runtime/modules/laser_scanner/target_list.hpp"

namespace hil::modules {
namespace {

class LaserScanner final : public WorldModule {
 public:
  explicit LaserScanner(const config::Value& parameters);

  const WorldPorts& ports() const noexcept override { return ports_; }
  void configure(World& world, const Setup& setup) override;
  void describe(std::vector<contribution::ModuleRecord>& records) const override;
  void step(WorldStep& context) noexcept override;
  void contribute(contribution::Contribution& report) const override;

 private:
  void fill_beams() noexcept;
  void begin_sweep(const WorldStep& context) noexcept;
  void take_returns(WorldStep& context, const rtstdb::Motion& carrier) noexcept;
  bool take_returns_of(std::uint64_t beam, const rtstdb::Motion& carrier) noexcept;
  void take_detection(const BeamReturn& beam_return, const Detection& detection, std::uint64_t beam,
                      std::uint32_t ordinal, const rtstdb::Pose& pose) noexcept;
  void compare_still_hits() noexcept;
  void write_outputs(WorldStep& context, const rtstdb::Motion& carrier) noexcept;
  void write_targets(WorldStep& context) noexcept;

  const ScannerOptions options_;
  ScanPattern pattern_;
  ObjectList objects_;
  TargetList targets_;
  Receiver receiver_;
  ReturnStatistics statistics_;
  SweepView view_;
  SweepCloud cloud_;
  WorldPorts ports_;

  const World* world_ = nullptr;
  rtstdb::Database* database_ = nullptr;
  std::unique_ptr<BeamQuery> beams_;
  std::unique_ptr<rtstdb::RayQuery> still_;
  std::unique_ptr<rtstdb::Transaction> transaction_, still_transaction_;
  rtstdb::EntityId carrier_;
  std::uint32_t mask_ = 0, object_mask_ = 0;
  std::optional<SweepComparison> comparison_;
  std::vector<std::optional<ComparedMotion>> compared_motion_;

  std::string instance_;
  std::int64_t step_ns_ = 0;
  SweepClock clock_;
  rtstdb::Version sweep_version_ = 0;  // of the first slice of the sweep
  AnswerDigest digest_;

  rtstdb::Motion last_carrier_;
};

LaserScanner::LaserScanner(const config::Value& parameters)
    : options_(read_scanner_options(parameters)),
      pattern_(options_.pattern),
      objects_({.max_objects = options_.max_objects, .keep_ns = options_.keep_ns}),
      targets_(options_.targets),
      view_(pattern_.beams()),
      ports_(scanner_ports(parameters, options_)),
      clock_(pattern_) {}

void LaserScanner::configure(World& world, const Setup& setup) {
  const TaskParameters& task = setup.task;
  instance_ = task.instance;
  step_ns_ = task.period_ns;
  clock_.set_first_release(task.offset_ns);
  const std::string caller = "module " + task.instance;
  world_ = &world;
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

  receiver_ = Receiver({.threshold_per_m2 = options_.threshold_per_m2,
                        .range_noise_m = options_.range_noise_m,
                        .noise_seed = noise_seed(task.seed, task.instance)});

  const auto capacity =
      static_cast<std::uint32_t>(std::max<std::uint64_t>(pattern_.max_beams_in_step(task.period_ns), 1));
  auto beams = BeamQuery::prepare(*database_, {.name = task.instance,
                                               .capacity = capacity,
                                               .divergence_rad = options_.divergence_rad,
                                               .returns_per_beam = options_.returns_per_beam,
                                               .mode = options_.mode,
                                               .ignore_motion = options_.ignore_motion});
  if (!beams) throw RefusedByDatabase(caller, beams.error());
  beams_ = std::move(beams).value();
  const auto reads = static_cast<std::uint32_t>(1 + compared.size());
  transaction_ = database_->make_transaction({.max_queries = 1, .max_reads = reads});
  if (!compared.empty()) {
    auto still = database_->prepare(rtstdb::RayQueryOptions{.name = task.instance + " without motion",
                                                            .capacity = capacity,
                                                            .mode = rtstdb::RayMode::closest,
                                                            .ignore_motion = true});
    if (!still) throw RefusedByDatabase(caller, still.error());
    still_ = std::move(still).value();
    still_transaction_ = database_->make_transaction({.max_queries = 1});
    comparison_.emplace(pattern_, std::move(compared));
  }
  if (options_.cloud_sweeps > 0)
    cloud_.open(setup.files, task.instance, pattern_.beams() * beams_->returns_per_beam(),
                options_.cloud_sweeps);
}

void LaserScanner::fill_beams() noexcept {
  for (std::uint64_t beam = clock_.first_beam(); beam < clock_.end_beam(); ++beam) {
    const std::int64_t time_ns = options_.ignore_motion ? clock_.sweep_begin_ns() : clock_.beam_time_ns(beam);
    const rtstdb::Ray ray{.origin_m = glm::vec3(options_.mount_m),
                          .direction = pattern_.direction(pattern_.column_of(beam), pattern_.row_of(beam)),
                          .lambda_min = 0.0f,
                          .lambda_max = static_cast<float>(options_.range_m),
                          .t = rtstdb::world_time_ns(time_ns),
                          .mask = mask_,
                          .carrier = carrier_};
    const auto index = static_cast<std::uint32_t>(beam - clock_.first_beam());
    beams_->set(index, ray);
    if (still_) still_->rays()[index] = ray;
  }
}

/// At the first slice of a sweep that has answers.
void LaserScanner::begin_sweep(const WorldStep& context) noexcept {
  view_.begin_sweep();
  targets_.clear();
  rtstdb::Pose sensor_pose = rtstdb::pose_at(last_carrier_, rtstdb::world_time_ns(clock_.sweep_begin_ns()));
  sensor_pose.p_world_m += sensor_pose.q_world * options_.mount_m;
  cloud_.begin_sweep(clock_.sweep_number(), sensor_pose, clock_.sweep_begin_ns());
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
    compared_motion_[i] =
        ComparedMotion{.center = {glm::dvec2(motion.p_world_m), glm::dvec2(motion.v_world_mps)},
                       .heading_rad = std::atan2(ahead.y, ahead.x)};
  }
  comparison_->begin_sweep(clock_.sweep_begin_ns(),
                           {.point = {glm::dvec2(sensor), glm::dvec2(carrier.v_world_mps)},
                            .heading_rad = std::atan2(forward.y, forward.x)},
                           compared_motion_);
}

void LaserScanner::take_returns(WorldStep& context, const rtstdb::Motion& carrier) noexcept {
  double detected_beams = 0.0;
  for (std::uint64_t beam = clock_.first_beam(); beam < clock_.end_beam(); ++beam)
    detected_beams += take_returns_of(beam, carrier) ? 1.0 : 0.0;
  if (comparison_ && still_transaction_->outcome().done()) compare_still_hits();
  context.outputs[ScannerOutputs(options_).hits()] = detected_beams;
}

/// Returns whether the receiver detected a return of the beam.
bool LaserScanner::take_returns_of(std::uint64_t beam, const rtstdb::Motion& carrier) noexcept {
  const auto index = static_cast<std::uint32_t>(beam - clock_.first_beam());
  bool is_detected = false;
  std::optional<rtstdb::Pose> pose;  // of the carrier at the beam's time
  for (std::uint32_t ordinal = 0; ordinal < beams_->returns_per_beam(); ++ordinal) {
    const BeamReturn beam_return = beams_->at(index, ordinal);
    const rtstdb::RayHit& hit = beam_return.hit;
    digest_.add(static_cast<std::uint32_t>(hit.status));
    if (hit.status == rtstdb::HitStatus::incomplete) statistics_.add_incomplete_beam();
    if (hit.status != rtstdb::HitStatus::hit) break;
    digest_.add(std::bit_cast<std::uint32_t>(hit.lambda));
    digest_.add(hit.entity.index);
    digest_.add(hit.triangle);
    if (options_.divergence_rad > 0.0) digest_.add(std::bit_cast<std::uint32_t>(beam_return.fraction));
    if (comparison_) comparison_->add_hit(hit, pattern_.column_of(beam), pattern_.row_of(beam), false);
    if (!pose) pose = rtstdb::pose_at(carrier, rtstdb::world_time_ns(clock_.beam_time_ns(beam)));
    const rtstdb::Material material = database_->material(hit.material).value_or(rtstdb::Material{});
    const glm::dvec3 direction(pattern_.direction(pattern_.column_of(beam), pattern_.row_of(beam)));
    const auto detection = receiver_.detect(beam_return, material, pose->q_world * direction,
                                            {clock_.sweep_begin_ns(), beam, ordinal});
    statistics_.add(beam_return, ordinal, detection);
    if (!detection) continue;
    is_detected = true;
    take_detection(beam_return, *detection, beam, ordinal, *pose);
    if (material.is_retro_reflector())
      targets_.add({.azimuth_rad = pattern_.azimuth_rad(pattern_.column_of(beam)),
                    .elevation_rad = pattern_.elevation_rad(pattern_.row_of(beam)),
                    .range_m = detection->range_m,
                    .intensity_per_m2 = detection->intensity_per_m2});
  }
  if (beams_->overflowed(index)) statistics_.add_overflowed_beam();
  return is_detected;
}

void LaserScanner::take_detection(const BeamReturn& beam_return, const Detection& detection,
                                  std::uint64_t beam, std::uint32_t ordinal,
                                  const rtstdb::Pose& pose) noexcept {
  const rtstdb::RayHit& hit = beam_return.hit;
  const std::uint32_t column = pattern_.column_of(beam);
  const std::uint32_t row = pattern_.row_of(beam);
  const std::int64_t beam_ns = clock_.beam_time_ns(beam);
  const glm::dvec3 in_sensor_m = glm::dvec3(pattern_.direction(column, row)) * detection.range_m;
  const glm::dvec3 p_world_m = pose.p_world_m + pose.q_world * (options_.mount_m + in_sensor_m);
  const auto sensor_point = [&](const glm::dvec3& p_m) {
    return contribution::SensorPoint{p_m.x,
                                     p_m.y,
                                     p_m.z,
                                     pattern_.azimuth_rad(column),
                                     pattern_.elevation_rad(row),
                                     detection.range_m,
                                     hit.entity.index};
  };
  if (view_.wants(beam))
    view_.add({.world = sensor_point(p_world_m),
               .sensor = sensor_point(in_sensor_m),
               .entity = hit.entity,
               .intensity_per_m2 = detection.intensity_per_m2});
  cloud_.add({.x_m = static_cast<float>(in_sensor_m.x),
              .y_m = static_cast<float>(in_sensor_m.y),
              .z_m = static_cast<float>(in_sensor_m.z),
              .intensity_per_m2 = static_cast<float>(detection.intensity_per_m2),
              .fraction = beam_return.fraction,
              .column = column,
              .row = row,
              .ordinal = ordinal,
              .entity = hit.entity.index,
              .material = hit.material.index,
              .time_s = static_cast<double>(beam_ns) * 1e-9});
  if ((hit.mask & object_mask_) == 0) return;
  // The carrier's rotation adds a negligible velocity.
  const glm::dvec3 v_world = glm::dvec3(hit.v_relative_mps) + last_carrier_.v_world_mps;
  objects_.add(hit.entity, column, beam_ns, p_world_m, v_world);
}

void LaserScanner::compare_still_hits() noexcept {
  const auto still_hits = still_->hits();
  for (std::uint64_t beam = clock_.first_beam(); beam < clock_.end_beam(); ++beam) {
    const rtstdb::RayHit& hit = still_hits[beam - clock_.first_beam()];
    if (hit.status != rtstdb::HitStatus::hit) continue;
    comparison_->add_hit(hit, pattern_.column_of(beam), pattern_.row_of(beam), true);
  }
}

void LaserScanner::step(WorldStep& context) noexcept {
  if (clock_.advance(context.time_ns, context.period_ns)) sweep_version_ = context.version;
  fill_beams();
  rtstdb::Terms terms{
      .deadline_class = context.read_class,
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
  beams_->add_to(*transaction_, clock_.beam_count());
  if (!context.execute(*database_, *transaction_).done() || transaction_->state(0) == nullptr) {
    clock_.note_missing_answers();
    return;
  }
  if (still_) {
    terms.read_at = rtstdb::ReadAt::pinned(sweep_version_);
    still_transaction_->begin(terms);
    still_transaction_->add_query(*still_, clock_.beam_count());
    if (!context.execute(*database_, *still_transaction_).done()) clock_.note_missing_answers();
  }
  last_carrier_ = transaction_->state(0)->row.motion;
  const std::int64_t end_ns = context.time_ns + context.period_ns;
  const glm::dvec3 near_m = rtstdb::pose_at(last_carrier_, rtstdb::world_time_ns(end_ns)).p_world_m;
  if (!clock_.has_answers()) {
    objects_.end_sweep(context.time_ns, near_m);  // of the sweep before, if its end was skipped
    begin_sweep(context);
  }
  clock_.note_answers();
  take_returns(context, last_carrier_);

  if (clock_.beam_count() > 0) objects_.advance(pattern_.column_of(clock_.end_beam() - 1), end_ns, near_m);
  if (clock_.ends_sweep()) {
    objects_.end_sweep(end_ns, near_m);
    cloud_.end_sweep();
    write_targets(context);
    if (comparison_ && clock_.is_complete()) comparison_->end_sweep();
  }
  objects_.forget(end_ns);
  write_outputs(context, last_carrier_);
}

void LaserScanner::write_outputs(WorldStep& context, const rtstdb::Motion& carrier) noexcept {
  // The outputs become visible at the deadline, so the age counts until then.
  const std::int64_t seen_ns = context.time_ns + context.period_ns;
  double count = 0.0;
  std::size_t out = 0;
  for (const ScannedObject& object : objects_.slots()) {
    if (!object.entity.valid()) {
      std::fill_n(context.outputs.begin() + static_cast<std::ptrdiff_t>(out), ScannerOutputs::per_object,
                  0.0);
      out += ScannerOutputs::per_object;
      continue;
    }
    count += 1.0;
    const rtstdb::Pose pose = rtstdb::pose_at(carrier, rtstdb::world_time_ns(object.time_ns));
    const glm::dquat to_carrier = glm::conjugate(pose.q_world);
    const glm::dvec3 at = to_carrier * (object.center_m - pose.p_world_m) - options_.list_origin_m;
    const glm::dvec3 v = to_carrier * object.velocity_mps;
    const double values[ScannerOutputs::per_object] = {
        1.0, at.x, at.y, v.x, v.y, object.length_m, static_cast<double>(seen_ns - object.time_ns) * 1e-6};
    for (const double value : values)
      context.outputs[out++] = value;
  }
  const ScannerOutputs outputs(options_);
  context.outputs[outputs.object_count()] = count;
  context.outputs[outputs.scan_index()] = static_cast<double>(clock_.sweeps() - 1);
  context.outputs[outputs.digest()] = digest_.number();
}

void LaserScanner::write_targets(WorldStep& context) noexcept {
  if (options_.targets == 0) return;
  const ScannerOutputs outputs(options_);
  context.outputs[outputs.target_count()] = static_cast<double>(targets_.found());
  const auto brightest = targets_.brightest();
  for (std::uint32_t k = 0; k < options_.targets; ++k) {
    const Target target = k < brightest.size() ? brightest[k] : Target{};
    const auto values = context.outputs.subspan(outputs.target(k), ScannerOutputs::per_target);
    values[0] = target.azimuth_rad;
    values[1] = target.elevation_rad;
    values[2] = target.range_m;
    values[3] = target.intensity_per_m2;
  }
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
                                      .divergence_rad = options_.divergence_rad,
                                      .returns_per_beam = options_.returns_per_beam,
                                      .fast_beams = options_.mode == rtstdb::ConeMode::fast,
                                      .threshold_per_m2 = options_.threshold_per_m2,
                                      .range_noise_m = options_.range_noise_m,
                                      .noise_seed = receiver_.options().noise_seed,
                                      .first_sweep_ns = clock_.first_release_ns(),
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
  if (clock_.sweeps() == 0) return;
  const auto name_of = [this](rtstdb::EntityId entity) { return world_->name_of(entity); };
  view_.contribute(instance_, name_of, report);
  statistics_.contribute(instance_, name_of, report);
  report.map.sensor_points = view_.map_points();
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
  return {.name = "laser_scanner",
          .about = "A laser scanner with one turning beam, carried by a body.",
          .parameters = scanner_schema(),
          .create = [](const config::Value& values, const TaskParameters& task,
                       config::Diagnostics& diagnostics) -> std::unique_ptr<AnyModule> {
            const std::size_t mistakes = diagnostics.count();
            check_scanner_options(values, diagnostics);
            if (diagnostics.count() > mistakes) return nullptr;
            const ScanPattern pattern(read_scanner_options(values).pattern);
            check_scanner_task(values, pattern, task.period_ns, diagnostics);
            return std::make_unique<LaserScanner>(values);
          },
          .recorded_list = scanner_list,
          .make_recorded_scanner = recorded_laser_scanner};
}

}  // namespace hil::modules
