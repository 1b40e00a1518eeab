#include "runtime/run/world_fields.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <hil/numbers.hpp>

#include "runtime/modules/recorded_field.hpp"

namespace hil::run {
namespace {

constexpr std::chrono::seconds between_reports(1);

contribution::FieldRecord record_of(const config::DistanceField& field) {
  return {.geometry = 0,
          .error_m = field.error_m,
          .cell_m = field.cell_m,
          .sign = field.sign,
          .max_bytes = field.max_bytes};
}

std::string millimetres(double metres) {
  return config::format_number(std::round(metres * 1e4) / 10.0) + " mm";
}

}  // namespace

rtstdb::FieldOptions WorldFields::options_of(const std::string& name, const config::DistanceField& field) {
  rtstdb::FieldOptions options = modules::field_options_of(record_of(field));
  options.on_first_use = true;
  options.progress = [this, name](const rtstdb::FieldProgress& progress) { show(name, progress); };
  return options;
}

void WorldFields::show(const std::string& name, const rtstdb::FieldProgress& progress) {
  const SteadyClock::time_point now = SteadyClock::now();
  if (shown_name_ != name) {
    shown_name_ = name;
    next_ = now + between_reports;
  }
  if (now < next_) return;
  next_ = now + between_reports;
  const std::uint64_t expected = std::max<std::uint64_t>(progress.expected, 1);
  log_.progress("building the distance field of " + name + ": " +
                std::to_string(std::min<std::uint64_t>(100 * progress.distances / expected, 100)) + " %");
}

void WorldFields::add(rtstdb::GeometryId geometry, const std::string& name,
                      const config::DistanceField& field) {
  Entry entry{name, record_of(field)};
  entry.record.geometry = geometry.index;
  entries_.push_back(std::move(entry));
}

void WorldFields::log_built(const rtstdb::Database& database) {
  for (const Entry& entry : entries_) {
    const auto built = database.field({entry.record.geometry});
    if (!built) continue;
    log_.info("distance field of " + entry.name + ": " + std::to_string(built->bytes) + " bytes, cells of " +
              millimetres(built->cell_m) + ", error at most " + millimetres(built->error_p99_m) +
              " in 99 of 100 points, built in " +
              config::format_number(std::round(built->seconds * 100.0) / 100.0) + " s");
  }
}

std::vector<contribution::FieldRecord> WorldFields::records() const {
  std::vector<contribution::FieldRecord> records;
  for (const Entry& entry : entries_)
    records.push_back(entry.record);
  return records;
}

}  // namespace hil::run
