// A rigid body with six degrees of freedom, moved by forces and torques in its own frame (rigid_body.hpp). It
// is an entity of the scenario, which gives its shape and its motion at run time 0; the parameters give its
// mass properties. From then on the module writes the entity's row, but only when the previous row no longer
// describes the motion (body_row.hpp).
//
// Inputs   force_x, force_y, force_z (N), torque_x, torque_y, torque_z (N m): at the centre of mass, which is
//          the origin of the entity, along the axes of the body; constant until the next step. An input that
//          is not fresh, or not finite, counts as 0.
//          hold  not 0: the body is held where it is, at rest in the world
// Outputs  x, y, z (m), vx, vy, vz (m/s): of the origin in the world
//          qw, qx, qy, qz: body frame to world frame
//          wx, wy, wz (rad/s): against an inertial frame, along the axes of the body, as a gyroscope measures
//          rows: rows written so far
//          stopped: 1 since the body would have left what the database permits; it rests from then on
//
// A step integrates from the previous step on with the inputs of that step, so after skipped releases it
// integrates over all of them.

#include <algorithm>
#include <array>
#include <cmath>

#include <hil/numbers.hpp>
#include <hil/world/world_module.hpp>
#include <rtstdb/limits.hpp>

#include "runtime/modules/free_body/body_row.hpp"
#include "runtime/modules/free_body/rigid_body.hpp"

namespace hil::modules {
namespace {

enum Input : std::size_t { force_x, force_y, force_z, torque_x, torque_y, torque_z, hold };

constexpr std::int64_t free_body_track_every_ns = 100'000'000;
constexpr std::size_t max_free_body_track_points = 1u << 15;
/// The largest number of integration steps in one step of the module. After a long pause they are longer
/// instead of more.
constexpr std::int64_t max_steps_at_once = 10'000;

struct FreeBodyOptions {
  std::string body;
  MassProperties properties;
  double orbit_radps = 0.0;
  std::int64_t integration_step_ns = 1'000'000;
  RowError permitted;
};

class FreeBody final : public WorldModule {
 public:
  FreeBody(FreeBodyOptions options, const config::Place& body_place);

  const WorldPorts& ports() const noexcept override { return ports_; }
  void configure(World& world, const Setup& setup) override;
  void step(WorldStep& context) noexcept override;
  void contribute(contribution::Contribution& report) const override;

 private:
  RigidBodyState integrated(RigidBodyState state, std::int64_t duration_ns) const noexcept;
  void take_inputs(WorldStep& context) noexcept;
  /// The largest share that a coordinate, the speed or the rate has of what the database permits.
  double used_of_limits(const RigidBodyState& state) const noexcept;
  void write_row(WorldStep& context) noexcept;
  void write_resting_row(WorldStep& context) noexcept;
  bool write(WorldStep& context, const rtstdb::Motion& motion) noexcept;
  void write_outputs(WorldStep& context) noexcept;

  const FreeBodyOptions options_;
  const RigidBody rigid_body_;
  WorldPorts ports_;
  rtstdb::Database* database_ = nullptr;
  std::unique_ptr<rtstdb::Transaction> transaction_;
  rtstdb::Reservation* reservation_ = nullptr;  ///< of the world; null: refused
  rtstdb::EntityId entity_;
  std::string instance_;

  RigidBodyState state_;
  std::int64_t state_ns_ = 0;  ///< run time of state_
  Wrench wrench_;              ///< since state_ns_
  bool is_held_ = false;       ///< since state_ns_
  bool has_stopped_ = false;   ///< at the border of what the database permits
  bool rests_ = false;         ///< its row says so
  bool row_is_too_coarse_ = false;
  BodyRow row_;
  std::uint64_t rows_ = 0, steps_ = 0;
  std::vector<contribution::TrackPoint> track_;
  std::int64_t next_track_ns_ = 0;
  EventLog::Kind stops_, held_, released_, coarse_;
};

std::vector<Port> input_ports() {
  std::vector<Port> ports;
  for (const char* axis : {"x", "y", "z"}) {
    ports.push_back({.name = std::string("force_") + axis,
                     .unit = "N",
                     .about = std::string("Force along the body's ") + axis});
  }
  for (const char* axis : {"x", "y", "z"}) {
    ports.push_back({.name = std::string("torque_") + axis,
                     .unit = "N m",
                     .about = std::string("Torque about the body's ") + axis});
  }
  ports.push_back({.name = "hold", .unit = "", .about = "Not 0: the body is held where it is"});
  return ports;
}

std::vector<Port> output_ports() {
  std::vector<Port> ports;
  for (const char* axis : {"x", "y", "z"})
    ports.push_back({.name = axis, .unit = "m", .about = "Origin of the body in the world"});
  for (const char* axis : {"vx", "vy", "vz"})
    ports.push_back({.name = axis, .unit = "m/s", .about = "Velocity of the origin in the world"});
  for (const char* part : {"qw", "qx", "qy", "qz"})
    ports.push_back({.name = part,
                     .unit = "",
                     .about = "Attitude: body frame to world frame",
                     .initial = part[1] == 'w' ? 1.0 : 0.0});
  for (const char* axis : {"wx", "wy", "wz"}) {
    ports.push_back({.name = axis,
                     .unit = "rad/s",
                     .about = "Angular rate against an inertial frame, along the body's axes"});
  }
  ports.push_back({.name = "rows", .unit = "", .about = "Rows written so far"});
  ports.push_back({.name = "stopped",
                   .unit = "",
                   .about = "1: the body would have left what the database permits, and rests from then on"});
  return ports;
}

FreeBody::FreeBody(FreeBodyOptions options, const config::Place& body_place)
    : options_(std::move(options)),
      rigid_body_(options_.properties, options_.orbit_radps),
      row_(options_.permitted) {
  ports_.inputs = input_ports();
  ports_.outputs = output_ports();
  ports_.moves.push_back({options_.body, body_place});
}

void FreeBody::configure(World& world, const Setup& setup) {
  const TaskParameters& task = setup.task;
  instance_ = task.instance;
  const std::string caller = "module " + task.instance;
  entity_ = world.entity_of(options_.body, caller);
  database_ = &world.database();
  transaction_ = database_->make_transaction({.max_writes = 1, .max_reads = 1});
  transaction_->begin({});
  transaction_->read(entity_);
  const rtstdb::Outcome& outcome = database_->execute(*transaction_);
  const rtstdb::EntityState* found = outcome.done() ? transaction_->state(0) : nullptr;
  if (found == nullptr)
    throw SetupError(caller + ": body '" + options_.body + "' can not be read: " + rtstdb::describe(outcome));
  const rtstdb::Motion motion = rtstdb::rebased(found->row.motion, rtstdb::world_time_ns(0));
  state_ = rigid_body_.state(motion.p_world_m, motion.v_world_mps, motion.q_world, motion.w_world_radps);
  row_.set_written(motion);
  track_.reserve(max_free_body_track_points);
  // A transaction that writes a row takes microseconds. The budget is larger, for a loaded machine.
  const rtstdb::Nanoseconds deadline(task.deadline_ns);
  reservation_ = world.reserve({.name = task.instance,
                                .period = rtstdb::Nanoseconds(task.period_ns),
                                .deadline = deadline,
                                .budget = std::min(rtstdb::Nanoseconds{100'000}, deadline)});
  stops_ = setup.events.add_kind(
      options_.body + " stops and rests from now on: it would have reached {} times " +
          config::format_number(rtstdb::max_coordinate_m) + " m, " +
          config::format_number(rtstdb::max_speed_mps) + " m/s or " +
          config::format_number(rtstdb::max_angular_rate_radps) + " rad/s, the largest values",
      3);
  held_ = setup.events.add_kind(options_.body + " is held");
  released_ = setup.events.add_kind(options_.body + " is released");
  coarse_ =
      setup.events.add_kind("the motion of " + options_.body +
                            " changes faster than a row per step can follow; use a faster task or larger "
                            "permitted errors");
}

RigidBodyState FreeBody::integrated(RigidBodyState state, std::int64_t duration_ns) const noexcept {
  if (is_held_ || duration_ns <= 0) return state;
  const std::int64_t needed = (duration_ns + options_.integration_step_ns - 1) / options_.integration_step_ns;
  const std::int64_t steps = std::clamp<std::int64_t>(needed, 1, max_steps_at_once);
  const double dt_s = static_cast<double>(duration_ns) * 1e-9 / static_cast<double>(steps);
  for (std::int64_t i = 0; i < steps; ++i)
    state = rigid_body_.step(state, wrench_, dt_s);
  return state;
}

void FreeBody::take_inputs(WorldStep& context) noexcept {
  const auto value = [&](Input input) {
    const signals::SignalValue& signal = context.inputs[input];
    return signal.fresh && std::isfinite(signal.value) ? signal.value : 0.0;
  };
  wrench_ = {.force_body_n = {value(force_x), value(force_y), value(force_z)},
             .torque_body_nm = {value(torque_x), value(torque_y), value(torque_z)}};
  const bool was_held = is_held_;
  is_held_ = value(hold) != 0.0;
  if (is_held_ && !was_held) {
    state_ = rigid_body_.state(state_.p_world_m, glm::dvec3(0.0), state_.q_world, glm::dvec3(0.0));
    context.events->note(held_, context.time_ns);
  } else if (was_held && !is_held_) {
    context.events->note(released_, context.time_ns);
  }
}

double FreeBody::used_of_limits(const RigidBodyState& state) const noexcept {
  const auto largest = [](const glm::dvec3& v) {
    return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  };
  const auto length = [](const glm::dvec3& v) { return std::hypot(v.x, v.y, v.z); };
  return std::max({largest(state.p_world_m) / rtstdb::max_coordinate_m,
                   length(state.v_world_mps) / rtstdb::max_speed_mps,
                   length(rigid_body_.w_world_radps(state)) / rtstdb::max_angular_rate_radps});
}

void FreeBody::step(WorldStep& context) noexcept {
  ++steps_;
  if (!has_stopped_) {
    const RigidBodyState now = integrated(state_, context.time_ns - state_ns_);
    state_ns_ = context.time_ns;
    if (used_of_limits(now) <= 1.0) {
      state_ = now;
      take_inputs(context);
      write_row(context);
    } else {
      has_stopped_ = true;
      state_ = rigid_body_.state(state_.p_world_m, glm::dvec3(0.0), state_.q_world, glm::dvec3(0.0));
      context.events->note(stops_, context.time_ns, used_of_limits(now));
    }
  }
  if (has_stopped_ && !rests_) write_resting_row(context);
  write_outputs(context);
}

void FreeBody::write_row(WorldStep& context) noexcept {
  const BodyStep step{.begin = state_,
                      .end = integrated(state_, context.period_ns),
                      .begin_time = context.world_time(),
                      .end_time = rtstdb::world_time_ns(context.time_ns + context.period_ns)};
  if (!(used_of_limits(step.end) <= 1.0)) return;  // the next step notes it
  const std::optional<rtstdb::Motion> row = row_.replacement(rigid_body_, step);
  if (!row) return;
  if (!write(context, *row)) {
    row_.forget();
    return;
  }
  row_.set_written(*row);
  if (row_is_too_coarse_ || row_.holds_at_end(step)) return;
  row_is_too_coarse_ = true;
  context.events->note(coarse_, context.time_ns);
}

void FreeBody::write_resting_row(WorldStep& context) noexcept {
  rests_ = write(context, {.p_world_m = state_.p_world_m,
                           .q_world = state_.q_world,
                           .v_world_mps = glm::dvec3(0.0),
                           .w_world_radps = glm::dvec3(0.0),
                           .valid_from = context.world_time()});
}

bool FreeBody::write(WorldStep& context, const rtstdb::Motion& motion) noexcept {
  transaction_->begin({.deadline_class = rtstdb::DeadlineClass::hard,
                       .deadline = context.deadline,
                       .importance = rtstdb::max_importance,
                       .world_time = context.world_time(),
                       .read_at = {},
                       .reservation = reservation_});
  transaction_->update_motion(entity_, motion);
  const bool done = context.execute(*database_, *transaction_).done();
  rows_ += done ? 1 : 0;
  return done;
}

void FreeBody::write_outputs(WorldStep& context) noexcept {
  const glm::dvec3& p = state_.p_world_m;
  const glm::dvec3& v = state_.v_world_mps;
  const glm::dquat& q = state_.q_world;
  const glm::dvec3 w = rigid_body_.w_body_radps(state_);
  const std::array values{p.x,
                          p.y,
                          p.z,
                          v.x,
                          v.y,
                          v.z,
                          q.w,
                          q.x,
                          q.y,
                          q.z,
                          w.x,
                          w.y,
                          w.z,
                          static_cast<double>(rows_),
                          has_stopped_ ? 1.0 : 0.0};
  std::copy(values.begin(), values.end(), context.outputs.begin());
  if (context.time_ns >= next_track_ns_ && track_.size() < max_free_body_track_points) {
    track_.push_back({context.time_ns, p.x, p.y});
    next_track_ns_ = context.time_ns + free_body_track_every_ns;
  }
}

void FreeBody::contribute(contribution::Contribution& report) const {
  report.map.tracks.push_back({options_.body, true, track_});
  const RowError& error = row_.largest_error();
  contribution::Section section{
      .name = "free_body_" + instance_,
      .title = "Rows of " + options_.body,
      .text =
          "A row describes the motion until it differs by more than the permitted errors; only then the "
          "next one is written.",
      .pictures = {},
      .tables = {}};
  const auto column = [](const char* title, const char* unit, int decimals) {
    return contribution::Column{.title = title, .numeric = true, .unit = unit, .decimals = decimals};
  };
  section.tables.push_back(
      {.columns = {column("Steps", "", 0), column("Rows written", "", 0),
                   column("Largest error of position", "mm", 4), column("Permitted", "mm", 4),
                   column("Largest error of angle", "mrad", 4), column("Permitted", "mrad", 4)},
       .rows = {{{.number = static_cast<double>(steps_)},
                 {.number = static_cast<double>(rows_)},
                 {.number = 1e3 * error.position_m},
                 {.number = 1e3 * options_.permitted.position_m},
                 {.number = 1e3 * error.angle_rad},
                 {.number = 1e3 * options_.permitted.angle_rad}}}});
  report.sections.push_back(std::move(section));
}

/// `list`: Ixx, Iyy, Izz of the tensor, and Ixy, Ixz, Iyz if it has six numbers.
glm::dmat3 tensor_of(const config::Value& list) {
  std::array<double, 6> parts{};
  for (std::size_t i = 0; i < list.items().size(); ++i)
    parts[i] = list.items()[i].number();
  const auto [xx, yy, zz, xy, xz, yz] = parts;
  return {glm::dvec3(xx, xy, xz), glm::dvec3(xy, yy, yz), glm::dvec3(xz, yz, zz)};
}

std::unique_ptr<AnyModule> create_free_body(const config::Value& parameters, const TaskParameters& /*task*/,
                                            config::Diagnostics& diagnostics) {
  const config::Value& inertia = parameters["inertia"];
  const std::size_t given = inertia.items().size();
  if (given != 3 && given != 6) {
    diagnostics.add(inertia.place(), "'inertia' has " + std::to_string(given) +
                                         " numbers; write three, xx, yy and zz, or six, then xy, xz and yz");
    return nullptr;
  }
  FreeBodyOptions options{
      .body = parameters["body"].text(),
      .properties = {.mass_kg = parameters["mass"].number(), .inertia_kgm2 = tensor_of(inertia)},
      .orbit_radps = parameters["mean_motion"].number(),
      .integration_step_ns = parameters["integration_step"].duration_ns(),
      .permitted = {.position_m = parameters["position_error"].number(),
                    .angle_rad = parameters["angle_error"].number()}};
  if (const std::string fault = fault_of_inertia(options.properties.inertia_kgm2); !fault.empty()) {
    diagnostics.add(inertia.place(), "'inertia': " + fault);
    return nullptr;
  }
  return std::make_unique<FreeBody>(std::move(options), parameters["body"].place());
}

}  // namespace

ModuleType free_body_type() {
  using config::Field;
  using config::Quantity;
  using config::Schema;
  const auto moment = Schema::quantity(Quantity::inertia_kgm2, -1e15, 1e15);
  return {.name = "free_body",
          .about = "A body that moves freely under forces and torques, with six degrees of freedom.",
          .parameters = Schema::record({
              Field::needed("body", Schema::text(),
                            "The entity of world.entities that it moves. The origin of its shape is its "
                            "centre of mass; the entity has its pose and velocities at the start."),
              Field::needed("mass", Schema::quantity(Quantity::mass_kg, 1e-6, 1e9), "The mass."),
              Field::needed("inertia", Schema::list(moment, 3, 6),
                            "The inertia tensor about the centre of mass along the body's axes: xx, yy, zz, "
                            "and if it is not diagonal xy, xz, yz, with the sign that makes the tensor."),
              Field::with_default("mean_motion", Schema::quantity(Quantity::angular_rate_radps, -1.0, 1.0),
                                  "0 rad/s",
                                  "The angular rate of the orbit (Clohessy-Wiltshire): the world turns about "
                                  "its z axis, x points away from the planet. 0: an inertial world."),
              Field::with_default("integration_step", Schema::quantity(Quantity::duration_s, 1e-6, 10.0),
                                  "1 ms", "The longest step of the integration (Runge-Kutta, order 4)."),
              Field::with_default("position_error", Schema::quantity(Quantity::length_m, 1e-9, 1e3), "0.1 mm",
                                  "The largest difference between the row's position and the body's."),
              Field::with_default("angle_error", Schema::quantity(Quantity::angle_rad, 1e-9, 3.0), "0.1 mrad",
                                  "The largest angle between the row's attitude and the body's."),
          }),
          .writes = true,
          .create = create_free_body};
}

}  // namespace hil::modules
