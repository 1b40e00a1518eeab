#include "runtime/modules/laser_scanner/return_statistics.hpp"

#include <algorithm>
#include <utility>

namespace hil::modules {
namespace {

using Counts = ReturnStatistics::Counts;

void count(Counts& counts, const BeamReturn& beam_return,
           const std::optional<Detection>& detection) noexcept {
  ++counts.returns;
  if (!detection) return;
  ++counts.detected;
  counts.nearest_m = std::min(counts.nearest_m, detection->range_m);
  counts.farthest_m = std::max(counts.farthest_m, detection->range_m);
  counts.dimmest_per_m2 = std::min(counts.dimmest_per_m2, detection->intensity_per_m2);
  counts.brightest_per_m2 = std::max(counts.brightest_per_m2, detection->intensity_per_m2);
  counts.smallest_fraction = std::min(counts.smallest_fraction, beam_return.fraction);
}

contribution::Table make_table(const char* first_title) {
  contribution::Table table;
  table.columns = {{.title = first_title},
                   {.title = "Returns", .numeric = true},
                   {.title = "Detected", .numeric = true},
                   {.title = "Nearest", .numeric = true, .unit = "m", .decimals = 3},
                   {.title = "Farthest", .numeric = true, .unit = "m", .decimals = 3},
                   {.title = "Dimmest", .numeric = true, .unit = "1/km²", .decimals = 3},
                   {.title = "Brightest", .numeric = true, .unit = "1/km²", .decimals = 3},
                   {.title = "Smallest fraction", .numeric = true, .decimals = 4}};
  return table;
}

void add_row(contribution::Table& table, std::string name, const Counts& counts) {
  const auto if_detected = [&](double value) {
    return contribution::Cell{.number = counts.detected > 0 ? value : contribution::not_known};
  };
  // Per square kilometre, so that the intensities of far bodies have digits.
  constexpr double m2_per_km2 = 1e6;
  table.rows.push_back({{.text = std::move(name)},
                        {.number = static_cast<double>(counts.returns)},
                        {.number = static_cast<double>(counts.detected)},
                        if_detected(counts.nearest_m),
                        if_detected(counts.farthest_m),
                        if_detected(counts.dimmest_per_m2 * m2_per_km2),
                        if_detected(counts.brightest_per_m2 * m2_per_km2),
                        if_detected(static_cast<double>(counts.smallest_fraction))});
}

}  // namespace

Counts& ReturnStatistics::counts_of(rtstdb::EntityId entity) noexcept {
  if (last_ < entity_count_ && entities_[last_].entity == entity) return entities_[last_].counts;
  const auto known = std::span(entities_).first(entity_count_);
  const auto found = std::ranges::find(known, entity, &OfEntity::entity);
  last_ = static_cast<std::size_t>(found - known.begin());
  if (found != known.end()) return found->counts;
  if (entity_count_ == max_entities) return others_;
  entities_[entity_count_].entity = entity;
  return entities_[entity_count_++].counts;
}

void ReturnStatistics::add(const BeamReturn& beam_return, std::uint32_t ordinal,
                           const std::optional<Detection>& detection) noexcept {
  count(counts_of(beam_return.hit.entity), beam_return, detection);
  count(by_ordinal_[ordinal], beam_return, detection);
}

void ReturnStatistics::contribute(const std::string& scanner,
                                  const std::function<std::string(rtstdb::EntityId)>& name_of,
                                  contribution::Contribution& report) const {
  const auto add_event = [&](std::uint64_t beams, const char* what) {
    if (beams > 0)
      report.events.push_back({report.end_ns, scanner + ": " + std::to_string(beams) + " beams " + what});
  };
  add_event(incomplete_beams_, "have no answer: the device's limits cut their search short");
  add_event(overflowed_beams_, "may have reached more bodies than their light is distributed among");
  if (entity_count_ == 0) return;
  contribution::Section section{
      .name = scanner + "_returns",
      .title = "Returns of " + scanner,
      .text =
          "The returns of the whole run. The intensity of a return is the reflectance of its material, times "
          "the covered fraction of the beam, times the cosine of the angle of incidence, over the squared "
          "range; for a retro-reflector its gain replaces the cosine."};
  contribution::Table by_entity = make_table("Body");
  for (const OfEntity& one : std::span(entities_).first(entity_count_))
    add_row(by_entity, name_of(one.entity), one.counts);
  if (others_.returns > 0) add_row(by_entity, "others", others_);
  section.tables.push_back(std::move(by_entity));
  if (by_ordinal_[1].returns > 0) {
    contribution::Table by_ordinal = make_table("Return");
    for (std::size_t k = 0; k < by_ordinal_.size() && by_ordinal_[k].returns > 0; ++k)
      add_row(by_ordinal, std::to_string(k + 1), by_ordinal_[k]);
    section.tables.push_back(std::move(by_ordinal));
  }
  report.sections.push_back(std::move(section));
}

}  // namespace hil::modules
