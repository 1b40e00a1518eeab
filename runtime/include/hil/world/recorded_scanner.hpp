#pragma once
// A scanner of a past run, as its module described it in world.json: its sweeps, whose beams a history traces
// again. The module's type creates it (ModuleType::make_recorded_scanner).
//
// Units: nanoseconds of run time, which is world time; metres. Threads: one.

#include <glm/ext/vector_double3.hpp>
#include <glm/ext/vector_float3.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <hil/world/beam_return.hpp>
#include <rtstdb/database.hpp>

namespace hil::modules {

struct ScannerDescription {
  std::string name;  ///< of the module in the scenario
  rtstdb::EntityId carrier;
  glm::dvec3 mount_m{0.0};  ///< origin of the beams in the carrier's frame
  double range_m = 0.0;
  std::uint32_t mask = 0;
  bool ignore_motion = false;  ///< the beams of a sweep meet the world as it is at the sweep's begin
  double divergence_rad = 0.0;
  std::uint32_t returns_per_beam = 1;
  rtstdb::ConeMode mode = rtstdb::ConeMode::exact;  ///< of beams with a divergence
  std::int64_t first_sweep_ns = 0;
  std::int64_t sweep_ns = 0;
  std::int64_t step_ns = 0;  ///< the beams of one step are one query, on the version at the step's begin
  std::uint32_t max_beams_per_step = 0;
};

class RecordedScanner {
 public:
  struct Beam {
    std::uint32_t column = 0, row = 0;
    std::int64_t time_ns = 0;   ///< since the start of the sweep
    glm::vec3 direction{0.0F};  ///< unit vector in the carrier's frame
    std::uint64_t index = 0;    ///< in the sweep
  };

  virtual ~RecordedScanner() = default;
  virtual const ScannerDescription& description() const noexcept = 0;
  /// The beams of the step that begins `offset_ns` after the sweep, in the order of time; at most
  /// max_beams_per_step.
  virtual std::vector<Beam> beams_of_step(std::int64_t offset_ns) const = 0;
  /// What the scanner's receiver measured of a return; empty: it did not detect it. `direction_world`: of the
  /// beam, a unit vector.
  virtual std::optional<Detection> detect(const BeamReturn& beam_return, const rtstdb::Material& material,
                                          const glm::dvec3& direction_world,
                                          const ReturnNumber& number) const noexcept = 0;
};

}  // namespace hil::modules
