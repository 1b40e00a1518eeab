#include "runtime/modules/laser_scanner/comparison_section.hpp"

#include <cmath>
#include <cstdio>
#include <utility>

namespace hil::modules {
namespace {

using contribution::Mark;

constexpr const char* section_text =
    "Points of one body as seen from the scanner, all pictures to one scale. Each beam has its own instant, "
    "so "
    "a body that moves with the turning beam looks longer than it is, and one that moves against it shorter. "
    "The dashed frame is the body's true length; the closed form follows from the two instants at which the "
    "beam meets its front and its rear.";

/// "traffic.northbound, sweep from 1.000 s on"
std::string caption(const char* format, const std::string& body, std::int64_t begin_ns) {
  char text[160];
  std::snprintf(text, sizeof text, format, body.c_str(), static_cast<double>(begin_ns) * 1e-9);
  return text;
}

contribution::Picture picture_of(const ComparedLengths& lengths, const std::string& body, std::string caption,
                                 const std::vector<contribution::SensorPoint>& points) {
  return {.title = lengths.title,
          .caption = std::move(caption),
          .entities = {body},
          .right = {0.0, -1.0},  // from the scanner, right is -y
          .outline_length_m = lengths.true_m,
          .dimensions = {{"measured", lengths.measured_m},
                         {"closed form", lengths.closed_form_m},
                         {"true length", lengths.true_m}},
          .points = points};
}

}  // namespace

contribution::Table lengths_table(const std::vector<ComparedLengths>& cases) {
  const auto metres = [](const char* title) {
    return contribution::Column{.title = title, .numeric = true, .unit = "m", .decimals = 3};
  };
  contribution::Table table;
  table.columns = {
      {.title = "Case"},       metres("True length"),
      metres("Measured"),      metres("Closed form"),
      metres("Difference"),    {.title = "Relative", .numeric = true, .unit = "%", .decimals = 2},
      metres("Tolerance (±)"), {.title = "Result"}};
  for (const ComparedLengths& lengths : cases) {
    const double difference_m = lengths.measured_m - lengths.closed_form_m;
    const bool agrees = std::abs(difference_m) <= lengths.tolerance_m;
    table.rows.push_back(
        {{.text = lengths.title},
         {.number = lengths.true_m},
         {.number = lengths.measured_m},
         {.number = lengths.closed_form_m},
         {.number = difference_m},
         {.number = 100.0 * difference_m / lengths.closed_form_m},
         {.number = lengths.tolerance_m},
         {.text = agrees ? "✓ agrees" : "✗ differs", .mark = agrees ? Mark::good : Mark::bad}});
  }
  return table;
}

void contribute_comparison(const SweepComparison& comparison, contribution::Contribution& report) {
  contribution::Section section{
      .name = "scan", .title = "What the scanner sees of a moving car", .text = section_text};
  std::vector<ComparedLengths> cases;
  for (std::size_t i = 0; i < comparison.bodies().size(); ++i) {
    const ComparedBody& body = comparison.bodies()[i];
    const SweepComparison::Finding& finding = comparison.finding(i);
    if (!finding.complete) {
      report.events.push_back(
          {report.end_ns,
           "the length of " + body.name + " is not compared: " +
               (finding.too_many
                    ? "a sweep had more than " + std::to_string(SweepComparison::max_points) + " points of it"
                    : std::string("no sweep saw its whole side"))});
      continue;
    }
    if (cases.empty()) {
      cases.push_back(
          {"motion ignored", body.length_m, finding.still.length_m, body.length_m, finding.tolerance_m});
      section.pictures.push_back(picture_of(cases.back(), body.name,
                                            caption("%s, every beam at %.3f s", body.name, finding.begin_ns),
                                            finding.still_points));
    }
    const bool stretched = finding.closed_form_m > body.length_m;
    cases.push_back({stretched ? "moving with the beam: stretched" : "moving against the beam: compressed",
                     body.length_m, finding.moving.length_m, finding.closed_form_m, finding.tolerance_m});
    section.pictures.push_back(picture_of(cases.back(), body.name,
                                          caption("%s, sweep from %.3f s on", body.name, finding.begin_ns),
                                          finding.moving_points));
  }
  if (cases.empty()) return;
  section.tables.push_back(lengths_table(cases));
  report.sections.push_back(std::move(section));
}

}  // namespace hil::modules
