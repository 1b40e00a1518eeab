#include "runtime/history/past.hpp"

#include <algorithm>
#include <type_traits>
#include <utility>

#include <rtstdb/limits.hpp>

#include "runtime/modules/recorded_field.hpp"

namespace hil::history {
namespace {

using Kind = HistoryError::Kind;

template <class T>
T taken(rtstdb::Result<T>&& result) {
  if (result) return std::move(result).value();
  const auto code = result.error().code;
  const bool device = code == rtstdb::ErrorCode::no_device || code == rtstdb::ErrorCode::device_lost ||
                      code == rtstdb::ErrorCode::out_of_memory;
  throw HistoryError(code == rtstdb::ErrorCode::file ? Kind::file
                     : device                        ? Kind::gpu
                                                     : Kind::question,
                     result.error().message);
}

rtstdb::WorldTime world_time(std::int64_t time_ns) {
  return rtstdb::world_time_ns(time_ns);
}

rtstdb::ReadAt known_at(const Instant& instant) {
  return rtstdb::ReadAt::as_of(world_time(instant.known_ns()));
}

}  // namespace

Past::Past(const RunHistory& history, std::int64_t from_ns, std::int64_t to_ns, const std::string& gpu)
    : history_(history), to_ns_(to_ns) {
  history.check_time(from_ns);
  history.check_time(to_ns);
  rtstdb::HistoryOptions options;
  options.directory = history.log();
  options.from = rtstdb::ReadAt::as_of(world_time(from_ns));
  options.to = rtstdb::ReadAt::as_of(world_time(to_ns));
  options.salvage = history.salvage();
  options.gpu = gpu;
  database_ = taken(rtstdb::open_history(options));
  transaction_ = database_->make_transaction({.max_queries = 1});
}

template <class Query>
const rtstdb::Outcome& Past::run_query(const rtstdb::ReadAt& read_at, Query& query, std::uint32_t count) {
  transaction_->begin({.read_at = read_at});
  if constexpr (std::is_same_v<Query, modules::BeamQuery>) {
    query.add_to(*transaction_, count);
  } else {
    transaction_->add_query(query, count);
  }
  return execute();
}

const rtstdb::Outcome& Past::execute() {
  const rtstdb::Outcome& outcome = database_->execute(*transaction_);
  if (!outcome.done())
    throw HistoryError(outcome.status == rtstdb::Status::device_lost ? Kind::gpu : Kind::question,
                       rtstdb::describe(outcome));
  return outcome;
}

std::vector<Body> Past::bodies(const Instant& instant) const {
  std::vector<Body> bodies;
  for (const rtstdb::EntityState& state : taken(database_->snapshot(known_at(instant))))
    bodies.push_back({state, rtstdb::pose_at(state.row.motion, world_time(instant.time_ns))});
  return bodies;
}

rtstdb::EntityState Past::row_of(const Instant& instant, rtstdb::EntityId entity) const {
  for (const rtstdb::EntityState& state : taken(database_->snapshot(known_at(instant))))
    if (state.id == entity) return state;
  throw HistoryError(Kind::question, "'" + history_.name_of(entity) + "' does not exist at that time");
}

Near Past::near(const Instant& instant, rtstdb::EntityId entity, const std::optional<glm::dvec3>& point_m,
                double radius_m, std::uint32_t mask) {
  const rtstdb::EntityState state = row_of(instant, entity);
  glm::dvec3 from_m = point_m.value_or(glm::dvec3(0.0));
  if (!point_m && state.row.geometry.valid()) {
    const rtstdb::Bounds bounds =
        rtstdb::bounds_of(taken(database_->geometry(state.row.geometry, known_at(instant))));
    from_m = state.row.scale * (glm::dvec3(bounds.minimum_m) + glm::dvec3(bounds.maximum_m)) * 0.5;
  }
  auto query = taken(database_->prepare(rtstdb::NearestQueryOptions{
      .name = "near", .capacity = 1, .target = rtstdb::NearestTarget::surface, .k = rtstdb::max_neighbors}));
  rtstdb::Nearest& point = query->points()[0];
  point.point_m = glm::vec3(from_m);
  point.radius_m = static_cast<float>(radius_m);
  point.t = world_time(instant.time_ns);
  point.mask = mask;
  point.carrier = point.excluded = entity;
  run_query(known_at(instant), *query, 1);
  const rtstdb::NearestAnswer& answer = query->answers()[0];
  const rtstdb::Pose pose = rtstdb::pose_at(state.row.motion, point.t);
  Near near{.from_world_m = pose.p_world_m + pose.q_world * from_m,
            .neighbors = {answer.neighbors.begin(), answer.neighbors.end()},
            .found = static_cast<std::uint32_t>(answer.neighbors.size()),
            .incomplete = answer.incomplete};
  if (near.neighbors.size() < rtstdb::max_neighbors) return near;
  const rtstdb::Region sphere{.shape = rtstdb::RegionShape::sphere,
                              .center_m = point.point_m,
                              .half_extent_m = glm::vec3(point.radius_m),
                              .mask = mask,
                              .carrier = entity};
  const auto all = in_region(instant, sphere, rtstdb::RegionLevel::surface);
  near.found =
      static_cast<std::uint32_t>(all.size() - static_cast<std::size_t>(std::ranges::count(all, entity)));
  return near;
}

std::vector<rtstdb::EntityId> Past::in_region(const Instant& instant, rtstdb::Region region,
                                              rtstdb::RegionLevel level) {
  region.t = world_time(instant.time_ns);
  for (std::uint32_t capacity = 64;;) {
    auto query = taken(database_->prepare(rtstdb::RegionQueryOptions{
        .name = "region", .capacity = 1, .level = level, .ids_per_region = capacity}));
    query->regions()[0] = region;
    run_query(known_at(instant), *query, 1);
    const rtstdb::RegionAnswer& answer = query->answers()[0];
    if (answer.incomplete)
      throw HistoryError(Kind::question,
                         "the search exceeded the limits of the device; use a smaller region");
    if (!answer.overflow) return {answer.entities.begin(), answer.entities.end()};
    if (answer.found > rtstdb::max_ids_per_region)
      throw HistoryError(Kind::question, std::to_string(answer.found) + " entities lie in the region, and " +
                                             std::to_string(rtstdb::max_ids_per_region) +
                                             " can be listed; use a smaller region");
    capacity = answer.found;
  }
}

std::vector<rtstdb::RayHit> Past::along(const Instant& instant, rtstdb::Ray ray, std::uint32_t hits) {
  auto query = taken(database_->prepare(rtstdb::RayQueryOptions{
      .name = "ray", .capacity = 1, .mode = rtstdb::RayMode::first, .hits_per_ray = hits}));
  ray.t = world_time(instant.time_ns);
  query->rays()[0] = ray;
  run_query(known_at(instant), *query, 1);
  std::vector<rtstdb::RayHit> found;
  for (const rtstdb::RayHit& hit : query->hits()) {
    if (hit.status == rtstdb::HitStatus::incomplete)
      throw HistoryError(Kind::question, "the search exceeded the limits of the device");
    if (hit.status == rtstdb::HitStatus::hit) found.push_back(hit);
  }
  return found;
}

modules::StillImage Past::image(const modules::RecordedCamera& camera, const Instant& instant) {
  return taken(modules::take_still_image(*database_, camera, known_at(instant), instant.time_ns));
}

void Past::build_fields() {
  for (const contribution::FieldRecord& record : history_.world().fields) {
    const rtstdb::GeometryId geometry{record.geometry};
    if (!database_->field(geometry))
      taken(database_->build_field(geometry, modules::field_options_of(record)));
  }
}

std::pair<std::int64_t, std::int64_t> Past::sweep_at(const modules::RecordedScanner& scanner,
                                                     std::int64_t time_ns) {
  const modules::ScannerDescription& facts = scanner.description();
  const std::int64_t sweeps = std::max<std::int64_t>(time_ns - facts.first_sweep_ns, 0) / facts.sweep_ns;
  const std::int64_t begin_ns = facts.first_sweep_ns + sweeps * facts.sweep_ns;
  return {begin_ns, begin_ns + facts.sweep_ns};
}

Sweep Past::scan(const modules::RecordedScanner& scanner, std::int64_t time_ns) {
  using ScannerBeam = modules::RecordedScanner::Beam;
  const modules::ScannerDescription& facts = scanner.description();
  Sweep sweep;
  std::tie(sweep.begin_ns, sweep.end_ns) = sweep_at(scanner, time_ns);
  if (facts.mode == rtstdb::ConeMode::fast) build_fields();
  const auto query =
      taken(modules::BeamQuery::prepare(*database_, {.name = "scan",
                                                     .capacity = facts.max_beams_per_step,
                                                     .divergence_rad = facts.divergence_rad,
                                                     .returns_per_beam = facts.returns_per_beam,
                                                     .mode = facts.mode,
                                                     .ignore_motion = facts.ignore_motion}));
  for (std::int64_t offset_ns = 0; offset_ns < facts.sweep_ns; offset_ns += facts.step_ns) {
    const std::int64_t step_ns = sweep.begin_ns + offset_ns;
    sweep.whole = step_ns < to_ns_;
    if (!sweep.whole) break;
    const std::vector<ScannerBeam> beams = scanner.beams_of_step(offset_ns);
    if (beams.empty()) continue;
    for (std::uint32_t i = 0; i < beams.size(); ++i) {
      const std::int64_t beam_ns = facts.ignore_motion ? 0 : beams[i].time_ns;
      query->set(i, {.origin_m = glm::vec3(facts.mount_m),
                     .direction = beams[i].direction,
                     .lambda_max = static_cast<float>(facts.range_m),
                     .t = world_time(sweep.begin_ns + beam_ns),
                     .mask = facts.mask,
                     .carrier = facts.carrier});
    }
    const Instant instant{.time_ns = facts.ignore_motion ? sweep.begin_ns : step_ns};
    const rtstdb::Motion motion = row_of(instant, facts.carrier).row.motion;
    run_query(known_at(instant), *query, static_cast<std::uint32_t>(beams.size()));
    for (std::uint32_t i = 0; i < beams.size(); ++i)
      sweep.beams.push_back(measure(scanner, beams[i], sweep.begin_ns, motion, *query, i));
  }
  return sweep;
}

Beam Past::measure(const modules::RecordedScanner& scanner, const modules::RecordedScanner::Beam& beam,
                   std::int64_t sweep_begin_ns, const rtstdb::Motion& carrier,
                   const modules::BeamQuery& query, std::uint32_t index) const {
  Beam measured{.column = beam.column, .row = beam.row, .time_ns = sweep_begin_ns + beam.time_ns};
  const rtstdb::Pose pose = rtstdb::pose_at(
      carrier, world_time(scanner.description().ignore_motion ? sweep_begin_ns : measured.time_ns));
  const glm::dvec3 along(beam.direction);
  for (std::uint32_t ordinal = 0; ordinal < query.returns_per_beam(); ++ordinal) {
    const modules::BeamReturn beam_return = query.at(index, ordinal);
    measured.incomplete = beam_return.hit.status == rtstdb::HitStatus::incomplete;
    if (beam_return.hit.status != rtstdb::HitStatus::hit) break;
    const auto material = database_->material(beam_return.hit.material).value_or(rtstdb::Material{});
    const auto detection =
        scanner.detect(beam_return, material, pose.q_world * along, {sweep_begin_ns, beam.index, ordinal});
    if (!detection) continue;
    const glm::dvec3 in_carrier_m = scanner.description().mount_m + along * detection->range_m;
    measured.returns.push_back({.ordinal = ordinal,
                                .beam_return = beam_return,
                                .detection = *detection,
                                .p_world_m = pose.p_world_m + pose.q_world * in_carrier_m});
  }
  return measured;
}

}  // namespace hil::history
