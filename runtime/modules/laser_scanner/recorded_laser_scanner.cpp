#include "runtime/modules/laser_scanner/recorded_laser_scanner.hpp"

#include <algorithm>

#include <hil/world/receiver.hpp>

#include "runtime/modules/laser_scanner/scanner_record.hpp"

namespace hil::modules {
namespace {

class RecordedLaserScanner final : public RecordedScanner {
 public:
  explicit RecordedLaserScanner(const ScannerRecord& scanner)
      : pattern_(pattern_of(scanner)),
        description_{.name = scanner.name,
                     .carrier = {scanner.carrier_index, scanner.carrier_generation},
                     .mount_m = {scanner.mount_m[0], scanner.mount_m[1], scanner.mount_m[2]},
                     .range_m = scanner.range_m,
                     .mask = scanner.mask,
                     .ignore_motion = scanner.ignore_motion,
                     .divergence_rad = scanner.divergence_rad,
                     .returns_per_beam = scanner.returns_per_beam,
                     .mode = scanner.fast_beams ? rtstdb::ConeMode::fast : rtstdb::ConeMode::exact,
                     .first_sweep_ns = scanner.first_sweep_ns,
                     .sweep_ns = scanner.sweep_ns,
                     .step_ns = scanner.step_ns,
                     .max_beams_per_step = static_cast<std::uint32_t>(std::min<std::uint64_t>(
                         pattern_.first_beam_at(scanner.step_ns) + pattern_.rows(), pattern_.beams()))},
        receiver_({.threshold_per_m2 = scanner.threshold_per_m2,
                   .range_noise_m = scanner.range_noise_m,
                   .noise_seed = scanner.noise_seed}) {}

  const ScannerDescription& description() const noexcept override { return description_; }
  std::vector<Beam> beams_of_step(std::int64_t offset_ns) const override {
    const std::uint64_t first = pattern_.first_beam_at(offset_ns);
    const std::uint64_t end =
        pattern_.first_beam_at(std::min(offset_ns + description_.step_ns, description_.sweep_ns));
    std::vector<Beam> beams;
    for (std::uint64_t beam = first; beam < end; ++beam) {
      const std::uint32_t column = pattern_.column_of(beam);
      const std::uint32_t row = pattern_.row_of(beam);
      beams.push_back({column, row, pattern_.time_ns(beam), pattern_.direction(column, row), beam});
    }
    return beams;
  }
  std::optional<Detection> detect(const BeamReturn& beam_return, const rtstdb::Material& material,
                                  const glm::dvec3& direction_world,
                                  const ReturnNumber& number) const noexcept override {
    return receiver_.detect(beam_return, material, direction_world, number);
  }

 private:
  ScanPattern pattern_;
  ScannerDescription description_;
  Receiver receiver_;
};

}  // namespace

std::unique_ptr<RecordedScanner> recorded_laser_scanner(const contribution::ModuleRecord& record) {
  return std::make_unique<RecordedLaserScanner>(to_scanner_record(record));
}

}  // namespace hil::modules
