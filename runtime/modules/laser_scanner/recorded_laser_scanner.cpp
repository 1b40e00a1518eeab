#include "runtime/modules/laser_scanner/recorded_laser_scanner.hpp"

#include <algorithm>

#include "runtime/modules/laser_scanner/scanner_record.hpp"

namespace hil::modules {
namespace {

class RecordedLaserScanner final : public RecordedScanner {
 public:
  explicit RecordedLaserScanner(const ScannerRecord& scanner)
      : pattern_(pattern_of(scanner)),
        facts_{.name = scanner.name,
               .carrier = {scanner.carrier_index, scanner.carrier_generation},
               .mount_m = {scanner.mount_m[0], scanner.mount_m[1], scanner.mount_m[2]},
               .range_m = scanner.range_m,
               .mask = scanner.mask,
               .ignore_motion = scanner.ignore_motion,
               .first_sweep_ns = scanner.first_sweep_ns,
               .sweep_ns = scanner.sweep_ns,
               .step_ns = scanner.step_ns,
               .max_beams_per_step = static_cast<std::uint32_t>(std::min<std::uint64_t>(
                   pattern_.first_beam_at(scanner.step_ns) + pattern_.rows(), pattern_.beams()))} {}

  const ScannerDescription& facts() const noexcept override { return facts_; }
  std::vector<Beam> beams_of_step(std::int64_t offset_ns) const override {
    const std::uint64_t first = pattern_.first_beam_at(offset_ns);
    const std::uint64_t end = pattern_.first_beam_at(std::min(offset_ns + facts_.step_ns, facts_.sweep_ns));
    std::vector<Beam> beams;
    for (std::uint64_t beam = first; beam < end; ++beam) {
      const std::uint32_t column = pattern_.column_of(beam);
      const std::uint32_t row = pattern_.row_of(beam);
      beams.push_back({column, row, pattern_.time_ns(beam), pattern_.direction(column, row)});
    }
    return beams;
  }

 private:
  ScanPattern pattern_;
  ScannerDescription facts_;
};

}  // namespace

std::unique_ptr<RecordedScanner> recorded_laser_scanner(const contribution::ModuleRecord& record) {
  return std::make_unique<RecordedLaserScanner>(to_scanner_record(record));
}

}  // namespace hil::modules
