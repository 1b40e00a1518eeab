#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "tests/gpu/runtime/module_fixture.hpp"

namespace hil::modules::test {

/// The module's own outputs; those of its bodies follow, 13 of each body with a mass.
enum RigidOutput : std::size_t {
  kinetic_energy,
  contacts,
  depth,
  touched,
  undecided,
  overflows,
  late,
  rows,
  stopped,
  elastic_energy,
  energy,
  work,
  dissipated
};
inline constexpr std::size_t first_body_output = 13;
enum BodyOutput : std::size_t { x, y, z, vx, vy, vz, qw, qx, qy, qz, wx, wy, wz };

/// Bodies of one rigid_bodies module in a world with a floor.
class RigidBodiesFixture : public ModuleFixture {
 protected:
  RigidBodiesFixture() : ModuleFixture({"body", "floor"}) {}

  void add(const std::string& name, const rtstdb::TriangleMesh& mesh, const rtstdb::Motion& motion,
           const std::string& layer = "body") {
    rtstdb::EntityRow row;
    row.geometry = world_->add_geometry(mesh, name);
    row.mask = world_->mask_of({layer}, "test");
    row.motion = motion;
    world_->create(name, row);
  }
  /// A plate whose upper face is at z = 0.
  void add_floor(double size_m = 20.0) {
    add("floor", rtstdb::make_box({size_m, size_m, 1.0}), {.p_world_m = {0.0, 0.0, -0.5}}, "floor");
  }
  std::unique_ptr<AnyModule> rigid_bodies(const std::string& parameters, std::int64_t period_ns) {
    period_ns_ = period_ns;
    auto module = make(*find_module_type("rigid_bodies"), parameters,
                       {.instance = "rigid", .period_ns = period_ns, .deadline_ns = period_ns});
    EXPECT_NE(module, nullptr) << diagnostics_.to_text();
    inputs_.assign(module->ports().inputs.size(), {});
    return module;
  }
  /// Steps to a run time, and the outputs at it. `each` sees the outputs of each step.
  template <typename Each>
  std::vector<double> run_to(AnyModule& module, double time_s, Each each) {
    std::vector<double> outputs;
    const auto until_ns = std::llround(time_s * 1e9);
    for (; next_ns_ <= until_ns; next_ns_ += period_ns_) {
      outputs =
          step(module, static_cast<std::uint64_t>(next_ns_ / period_ns_), next_ns_, period_ns_, inputs_);
      each(outputs);
    }
    return outputs;
  }
  std::vector<double> run_to(AnyModule& module, double time_s) {
    return run_to(module, time_s, [](const std::vector<double>&) {});
  }
  static double of(const std::vector<double>& outputs, std::size_t body, BodyOutput output) {
    return outputs[first_body_output + 13 * body + output];
  }
  bool has_event(const std::string& words) const {
    for (const RunEvents::Event& event : events_.events())
      if (event.text.find(words) != std::string::npos) return true;
    return false;
  }

  std::vector<signals::SignalValue> inputs_;
  std::int64_t period_ns_ = 0, next_ns_ = 0;
};

}  // namespace hil::modules::test
