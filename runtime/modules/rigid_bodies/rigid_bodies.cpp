// Rigid bodies that may touch each other. They are entities of the scenario, which gives their shapes and
// their motion at run time 0. Each step queries their contacts once and integrates all bodies to the next
// step with the forces of these contacts (contact_law.hpp, frozen_contacts.hpp).
//
// Inputs   of each body B with a mass:
//          B_force_x, B_force_y, B_force_z (N), B_torque_x, B_torque_y, B_torque_z (N m): at the centre of
//          mass along the axes of the body; constant until the next step. An input that is not fresh, or not
//          finite, counts as 0.
//          B_hold  not 0: the body is held where it is, at rest in the world
// Outputs  kinetic_energy (J): of all bodies
//          contacts: points that press now; depth (m): of the deepest
//          touched: pairs that have touched so far
//          undecided: pairs so far whose contact the query could not decide, once a step
//          overflows: steps so far whose answer does not list all pairs, or that had no answer
//          late: pairs so far that touched and were not within the margin in the step before
//          rows: rows written so far
//          stopped: bodies that would have left what the database permits; they rest from then on
//          elastic_energy (J): that the contacts hold
//          energy (J): of motion, of height above the world's origin along gravity, and elastic
//          work (J): so far of the inputs, and of fixed bodies that move; less the energy of motion of bodies
//          that were held or stopped
//          dissipated (J): energy at run time 0, plus work, minus energy: what dampers, friction and contacts
//          that change have taken so far. Never below 0, up to rounding and the error of the integration.
//          of each body B with a mass: B.x ... as of a free_body (body_ports.hpp)
//
// A row is written in each step while a body has contacts or is near one, otherwise only when the previous
// row no longer describes the motion. It has the body's pose at the begin and at the end of the step, so that
// the next answer is that of the bodies' poses.

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <utility>

#include <hil/world/world_module.hpp>

#include "runtime/modules/rigid_bodies/body_options.hpp"
#include "runtime/modules/rigid_bodies/body_ports.hpp"
#include "runtime/modules/rigid_bodies/body_set.hpp"
#include "runtime/modules/rigid_bodies/body_writer.hpp"
#include "runtime/modules/rigid_bodies/contact_watch.hpp"

namespace hil::modules {
namespace {

constexpr std::array<const char*, 13> module_outputs{
    "kinetic_energy", "contacts", "depth",          "touched", "undecided", "overflows", "late",
    "rows",           "stopped",  "elastic_energy", "energy",  "work",      "dissipated"};

constexpr std::int64_t rigid_track_every_ns = 100'000'000;
constexpr std::size_t max_rigid_track_points = 1u << 13;

class RigidBodies final : public WorldModule {
 public:
  explicit RigidBodies(RigidBodiesOptions options);

  const WorldPorts& ports() const noexcept override { return ports_; }
  void configure(World& world, const Setup& setup) override;
  void step(WorldStep& context) noexcept override;
  void contribute(contribution::Contribution& report) const override;

 private:
  void take_inputs(WorldStep& context) noexcept;
  void stop_beyond_limits(WorldStep& context) noexcept;
  void write_outputs(WorldStep& context) noexcept;
  void note_tracks(std::int64_t time_ns) noexcept;
  double energy_j() const noexcept;

  const RigidBodiesOptions options_;
  WorldPorts ports_;
  double substep_ns_ = 0.0;
  std::string instance_;
  std::unique_ptr<BodySet> bodies_;
  std::unique_ptr<ContactWatch> watch_;
  std::unique_ptr<BodyWriter> writer_;
  std::int64_t state_ns_ = 0;  ///< run time of the states
  double stopped_ = 0.0;
  std::optional<double> first_energy_j_;  ///< at run time 0
  struct Kinds {
    EventLog::Kind stops, held, released;
  };
  std::vector<Kinds> kinds_;                                   ///< by body
  std::vector<std::vector<contribution::TrackPoint>> tracks_;  ///< by body; empty of fixed ones
  std::int64_t next_track_ns_ = 0;
};

RigidBodies::RigidBodies(RigidBodiesOptions options) : options_(std::move(options)) {
  const auto output = [&](std::size_t i, const char* unit, const char* about) {
    ports_.outputs.push_back({.name = module_outputs[i], .unit = unit, .about = about});
  };
  output(0, "J", "Of all bodies");
  output(1, "", "Points that press now");
  output(2, "m", "Of the deepest contact now");
  output(3, "", "Pairs that have touched so far");
  output(4, "", "Pairs so far whose contact could not be decided, once a step");
  output(5, "", "Steps so far whose answer does not list all pairs, or that had no answer");
  output(6, "", "Pairs so far that touched and were not near in the step before");
  output(7, "", "Rows written so far");
  output(8, "", "Bodies that rest since they would have left what the database permits");
  output(9, "J", "Elastic energy of the contacts");
  output(10, "J", "Kinetic, potential and elastic energy");
  output(11, "J", "Work of the inputs and of fixed bodies that move, so far");
  output(12, "J", "Energy that contacts have taken so far: energy at run time 0, plus work, minus energy");
  const auto append = [](std::vector<Port>& ports, std::vector<Port> more) {
    ports.insert(ports.end(), more.begin(), more.end());
  };
  for (const RigidBodyOptions& body : options_.bodies) {
    if (!body.properties) {
      ports_.bodies.push_back({body.name, body.place});
      continue;
    }
    ports_.moves.push_back({body.name, body.place});
    append(ports_.inputs, body_inputs(body.name));
    append(ports_.outputs, body_outputs(body.name));
  }
}

void RigidBodies::configure(World& world, const Setup& setup) {
  const TaskParameters& task = setup.task;
  instance_ = task.instance;
  const std::string caller = "module " + task.instance;
  substep_ns_ = static_cast<double>(task.period_ns) / options_.substeps;
  std::vector<rtstdb::EntityId> entities;
  for (const RigidBodyOptions& body : options_.bodies)
    entities.push_back(world.entity_of(body.name, caller));
  const std::vector<PlacedBody> placed =
      read_placed_bodies(world, caller, options_, entities, 1e-9 * substep_ns_);
  watch_ = std::make_unique<ContactWatch>(world, setup.events, caller, options_, entities, placed);
  std::vector<rtstdb::Motion> motions;
  for (const PlacedBody& body : placed)
    motions.push_back(rtstdb::rebased(body.row.motion, rtstdb::world_time_ns(0)));
  bodies_ = std::make_unique<BodySet>(options_, motions);
  writer_ = std::make_unique<BodyWriter>(world, task, std::move(entities), *bodies_, options_.permitted);

  for (const RigidBodyOptions& body : options_.bodies) {
    tracks_.emplace_back();
    if (body.properties) tracks_.back().reserve(max_rigid_track_points);
    kinds_.push_back(
        {.stops = setup.events.add_kind(body.name + " stops and rests from now on: it would have "
                                                    "reached {} times what the database permits",
                                        3),
         .held = setup.events.add_kind(body.name + " is held"),
         .released = setup.events.add_kind(body.name + " is released")});
  }
}

void RigidBodies::step(WorldStep& context) noexcept {
  if (context.time_ns != state_ns_) {  // releases were skipped
    bodies_->advance(watch_->contacts(), watch_->touches(), state_ns_, context.time_ns, substep_ns_);
    writer_->write_states(context, *bodies_);
  }
  watch_->take(context, *bodies_, writer_->version());
  take_inputs(context);
  write_outputs(context);
  note_tracks(context.time_ns);
  writer_->begin_step(*bodies_);
  state_ns_ = context.time_ns + context.period_ns;
  bodies_->advance(watch_->contacts(), watch_->touches(), context.time_ns, state_ns_, substep_ns_);
  stop_beyond_limits(context);
  writer_->write_step(context, *bodies_, watch_->is_near());
}

void RigidBodies::take_inputs(WorldStep& context) noexcept {
  std::size_t offset = 0;
  for (std::size_t i = 0; i < kinds_.size(); ++i) {
    BodySet::Body& body = bodies_->bodies()[i];
    if (!body.rigid_body) continue;
    const BodyInputs inputs = read_body_inputs(context.inputs.subspan(offset, inputs_per_body));
    offset += inputs_per_body;
    body.wrench = inputs.wrench;
    if (inputs.hold == body.is_held) continue;
    body.is_held = inputs.hold;
    context.events->note(inputs.hold ? kinds_[i].held : kinds_[i].released, context.time_ns);
    if (!inputs.hold) continue;
    const double before_j = energy_j();
    BodySet::halt(body);
    bodies_->add_work(energy_j() - before_j);
  }
}

void RigidBodies::stop_beyond_limits(WorldStep& context) noexcept {
  for (std::size_t i = 0; i < kinds_.size(); ++i) {
    BodySet::Body& body = bodies_->bodies()[i];
    if (!body.rigid_body || body.has_stopped) continue;
    const double used = BodySet::used_of_limits(body);
    if (used <= 1.0) continue;
    const double before_j = energy_j();
    body.has_stopped = true;
    body.state = writer_->state_at_begin(i);
    BodySet::halt(body);
    bodies_->add_work(energy_j() - before_j);
    stopped_ += 1.0;
    context.events->note(kinds_[i].stops, context.time_ns, used);
  }
}

double RigidBodies::energy_j() const noexcept {
  return bodies_->kinetic_energy_j() + bodies_->potential_energy_j() + watch_->contacts().elastic_energy_j();
}

void RigidBodies::write_outputs(WorldStep& context) noexcept {
  const double energy = energy_j();
  if (!first_energy_j_) first_energy_j_ = energy - bodies_->work_j();
  const ContactWatch::Counts& counts = watch_->counts();
  const std::array<double, module_outputs.size()> values{bodies_->kinetic_energy_j(),
                                                         static_cast<double>(counts.pressing),
                                                         counts.depth_m,
                                                         static_cast<double>(watch_->touches().count()),
                                                         static_cast<double>(counts.undecided),
                                                         static_cast<double>(counts.overflows),
                                                         static_cast<double>(counts.late),
                                                         static_cast<double>(writer_->rows()),
                                                         stopped_,
                                                         watch_->contacts().elastic_energy_j(),
                                                         energy,
                                                         bodies_->work_j(),
                                                         *first_energy_j_ + bodies_->work_j() - energy};
  std::copy(values.begin(), values.end(), context.outputs.begin());
  std::size_t offset = values.size();
  for (const BodySet::Body& body : std::as_const(*bodies_).bodies()) {
    if (!body.rigid_body) continue;
    write_body_outputs(body, context.outputs.subspan(offset, outputs_per_body));
    offset += outputs_per_body;
  }
}

void RigidBodies::note_tracks(std::int64_t time_ns) noexcept {
  if (time_ns < next_track_ns_) return;
  next_track_ns_ = time_ns + rigid_track_every_ns;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    const BodySet::Body& body = std::as_const(*bodies_).bodies()[i];
    if (body.rigid_body && tracks_[i].size() < max_rigid_track_points)
      tracks_[i].push_back({time_ns, body.state.p_world_m.x, body.state.p_world_m.y});
  }
}

void RigidBodies::contribute(contribution::Contribution& report) const {
  for (std::size_t i = 0; i < tracks_.size(); ++i)
    if (!tracks_[i].empty()) report.map.tracks.push_back({options_.bodies[i].name, true, tracks_[i]});
  const ContactWatch::Counts& counts = watch_->counts();
  contribution::Section section{
      .name = "contacts_" + instance_,
      .title = "Contacts of " + instance_,
      .text =
          "The first contact of each pair of bodies: its place in the world, the speed at which the "
          "surfaces closed there, and the depth of the first substep in contact. " +
          std::to_string(counts.undecided) + " pairs were undecided, " + std::to_string(counts.overflows) +
          " answers incomplete, and " + std::to_string(counts.late) +
          " pairs touched and were not near in the step before.",
      .pictures = {},
      .plots = {},
      .tables = {}};
  if (watch_->touches().count() > 0) section.tables.push_back(watch_->touches().table());
  report.sections.push_back(std::move(section));
}

}  // namespace

ModuleType rigid_bodies_type() {
  return {.name = "rigid_bodies",
          .about = "Rigid bodies that touch: gravity, forces and torques, and contacts with friction.",
          .parameters = rigid_bodies_schema(),
          .writes = true,
          .create = [](const config::Value& parameters, const TaskParameters& task,
                       config::Diagnostics& diagnostics) -> std::unique_ptr<AnyModule> {
            auto options = read_rigid_bodies(parameters, diagnostics);
            if (!options) return nullptr;
            check_contact_law(*options, parameters,
                              1e-9 * static_cast<double>(task.period_ns) / options->substeps, diagnostics);
            return std::make_unique<RigidBodies>(std::move(*options));
          }};
}

}  // namespace hil::modules
