// The paper's Figure 8 on configs/crossing: the apparent length of a passing car, measured from the scan, is
// compared with the closed form for both directions of travel; without motion the car has its true length.
//
// The expected values are computed here, from the numbers of the scenario and from the positions in
// signals.csv. Of the comparison that the run reports, the points are measured again, and its lengths are
// checked.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "runtime/run/session.hpp"
#include "tests/paths.h"
#include "tests/support/temporary_folder.hpp"

namespace hil::run {
namespace {

/// signals.csv by column.
class Signals {
 public:
  explicit Signals(const std::string& csv);
  /// The signal's value at this time, interpolated between two rows. Throws when the signal does not exist or
  /// has no row before and after.
  double at(const std::string& signal, double time_s) const;

 private:
  std::map<std::string, std::vector<double>> columns_;
};

Signals::Signals(const std::string& csv) {
  std::istringstream stream(csv);
  std::string line;
  std::getline(stream, line);
  std::vector<std::string> names;
  std::istringstream header(line);
  for (std::string name; std::getline(header, name, ',');)
    names.push_back(name);
  while (std::getline(stream, line)) {
    std::istringstream row(line);
    std::string cell;
    for (const std::string& name : names) {
      if (!std::getline(row, cell, ','))
        throw std::runtime_error("a row of signals.csv is too short: " + line);
      columns_[name].push_back(std::strtod(cell.c_str(), nullptr));
    }
  }
}

double Signals::at(const std::string& signal, double time_s) const {
  const auto column = columns_.find(signal);
  if (column == columns_.end()) throw std::runtime_error("signals.csv has no " + signal);
  const std::vector<double>& times = columns_.at("time_s");
  const auto after = std::upper_bound(times.begin(), times.end(), time_s);
  if (after == times.begin() || after == times.end())
    throw std::runtime_error("signals.csv has no rows around " + std::to_string(time_s) + " s");
  const auto next = static_cast<std::size_t>(after - times.begin());
  const double share = (time_s - times[next - 1]) / (times[next] - times[next - 1]);
  return (1.0 - share) * column->second[next - 1] + share * column->second[next];
}

struct CrossingRun {
  config::Scenario scenario;
  report::RunRecord record;
  Signals signals;
};

/// Runs the repository's crossing with these settings changed. Throws what run_session throws, and
/// runtime_error with all mistakes when the settings are refused.
CrossingRun run_crossing(const std::vector<std::string>& overrides) {
  std::vector<std::string> all = overrides;
  all.emplace_back("clock=virtual");
  config::Diagnostics diagnostics;
  auto scenario = config::load_scenario(std::string(HIL_SOURCE_DIR) + "/configs/crossing/crossing.yaml", all,
                                        scenario_types(), diagnostics);
  if (!scenario) throw std::runtime_error(diagnostics.to_text());
  const auto kept = std::make_unique<config::Scenario>(std::move(*scenario));
  auto wiring = wire(*kept, diagnostics);
  if (!wiring) throw std::runtime_error(diagnostics.to_text());
  const tests::TemporaryFolder folder;
  const std::atomic<bool> never{false};
  SessionResult result = run_session(std::move(*wiring),
                                     {.directory = folder.path(),
                                      .overrides = {},
                                      .fail_on = {},
                                      .program_folders = {std::string(HIL_BINARY_DIR) + "/bin"},
                                      .every_second = {}},
                                     never);
  return {std::move(*kept), std::move(result.record), Signals(folder.read("signals.csv"))};
}

struct Point {
  double x_m = 0.0;
  double y_m = 0.0;
};

Point operator+(const Point& a, const Point& b) {
  return {a.x_m + b.x_m, a.y_m + b.y_m};
}
Point operator*(double s, const Point& a) {
  return {s * a.x_m, s * a.y_m};
}

/// A body during a sweep, which does not turn; time begins with the sweep.
struct Body {
  const CrossingRun& run;
  std::string name;
  double begin_s = 0.0;
  Point travel;
  double length_m = 0.0, width_m = 0.0;

  /// Its position in signals.csv.
  Point center(double t_s) const {
    return {run.signals.at(name + ".x", begin_s + t_s), run.signals.at(name + ".y", begin_s + t_s)};
  }
  /// The point of the body at this distance ahead and to the left of its middle.
  Point at(double ahead_m, double left_m, double t_s) const {
    return center(t_s) + ahead_m * travel + left_m * Point{-travel.y_m, travel.x_m};
  }
};

/// The scanner, from the scenario.
struct Scanner {
  double horizontal_rad = 0.0, pitch_rad = 0.0, period_s = 0.0, mount_x_m = 0.0, mount_y_m = 0.0;
  bool left_to_right = true;
};

const config::TaskSection& section(const config::Scenario& scenario, const std::string& module) {
  for (const config::TaskSection& task : scenario.tasks) {
    if (task.module.text == module) return task;
  }
  throw std::runtime_error("no module " + module);
}

Scanner scanner_of(const config::Scenario& scenario) {
  const config::Value& p = section(scenario, "scanner").parameters;
  const auto& mount = p["mount"].items();
  return {.horizontal_rad = p["horizontal"].number(),
          .pitch_rad = p["horizontal"].number() / static_cast<double>(p["columns"].integer()),
          .period_s = 1.0 / p["scan_rate"].number(),
          .mount_x_m = mount[0].number(),
          .mount_y_m = mount[1].number(),
          .left_to_right = p["sweep"].text() == "left_to_right"};
}

Body body_of(const CrossingRun& run, const std::string& name, double begin_s) {
  const config::Value& vehicle =
      section(run.scenario, "traffic").parameters["vehicles"][name.substr(name.find('.') + 1)];
  const double heading = vehicle["heading"].number();
  return {.run = run,
          .name = name,
          .begin_s = begin_s,
          .travel = {std::cos(heading), std::sin(heading)},
          .length_m = vehicle["size"].items()[0].number(),
          .width_m = vehicle["size"].items()[1].number()};
}

/// In the axes of the sensor, which are those of the ego.
Point turned(const Body& ego, const Point& d) {
  return {d.x_m * ego.travel.x_m + d.y_m * ego.travel.y_m, -d.x_m * ego.travel.y_m + d.y_m * ego.travel.x_m};
}

Point seen(const Scanner& scanner, const Body& ego, const Point& p, double t_s) {
  return turned(ego, p + (-1.0) * ego.at(scanner.mount_x_m, scanner.mount_y_m, t_s));
}

/// When the beam meets this point of the body: the time at which the beam has the direction of the point.
double meeting_s(const Scanner& scanner, const Body& ego, const Body& body, double ahead_m, double left_m) {
  double t_s = 0.5 * scanner.period_s;
  for (int i = 0; i < 200; ++i) {
    const Point at = seen(scanner, ego, body.at(ahead_m, left_m, t_s), t_s);
    const double azimuth = std::atan2(at.y_m, at.x_m);
    const double share = 0.5 - (scanner.left_to_right ? azimuth : -azimuth) / scanner.horizontal_rad;
    t_s += 0.5 * (std::clamp(share, 0.0, 1.0) * scanner.period_s - t_s);  // damped, so that it converges
  }
  return t_s;
}

struct Expected {
  double length_m = 0.0;  // the closed form
  double pitch_m = 0.0;   // of one column on the side of the body, at the edge where it is larger
};

/// The length of the side that faces the sensor, between its rear and its front edge, each when the beam
/// meets it.
Expected closed_form(const Scanner& scanner, const Body& ego, const Body& body) {
  const Point middle = seen(scanner, ego, body.center(0.0), 0.0);
  const Point left = turned(ego, {-body.travel.y_m, body.travel.x_m});
  const double side_m = (middle.x_m * left.x_m + middle.y_m * left.y_m < 0.0 ? 0.5 : -0.5) * body.width_m;
  const Point along = turned(ego, body.travel);
  Expected expected;
  for (const double end : {0.5, -0.5}) {
    const double ahead_m = end * body.length_m;
    const double t_s = meeting_s(scanner, ego, body, ahead_m, side_m);
    const Point at = seen(scanner, ego, body.at(ahead_m, side_m, t_s), t_s);
    expected.length_m += 2.0 * end * (at.x_m * along.x_m + at.y_m * along.y_m);
    // Where the beam runs along the side, a column covers more of it.
    const double range_m = std::hypot(at.x_m, at.y_m);
    const double upright = std::abs(at.x_m * left.x_m + at.y_m * left.y_m) / range_m;
    expected.pitch_m = std::max(expected.pitch_m, scanner.pitch_rad * range_m / upright);
  }
  return expected;
}

/// The extent, along the direction of travel, of the picture's points on the side of the body. `t_of` is the
/// time of a point.
template <typename TimeOf>
double measured(const Scanner& scanner, const Body& ego, const Body& body, const Expected& expected,
                const report::Picture& picture, TimeOf t_of) {
  double lowest_m = 1e300;
  double highest_m = -1e300;
  double farthest_off_m = 0.0;
  const Point along = turned(ego, body.travel);
  for (const report::SensorPoint& p : picture.points) {
    const double t_s = t_of(p);
    // Is the point on a long side of the body at this time?
    const Point middle = seen(scanner, ego, body.center(t_s), t_s);
    const Point d{p.x_m - middle.x_m, p.y_m - middle.y_m};
    const double ahead_m = d.x_m * along.x_m + d.y_m * along.y_m;
    const double beside_m = std::abs(-d.x_m * along.y_m + d.y_m * along.x_m) - 0.5 * body.width_m;
    farthest_off_m = std::max({farthest_off_m, beside_m, std::abs(ahead_m) - 0.5 * body.length_m});
    if (beside_m < -0.02 || std::abs(ahead_m) > 0.5 * body.length_m - 1e-4) continue;
    // The position, if all points are taken as measured at one time.
    const double seen_m = p.x_m * along.x_m + p.y_m * along.y_m;
    lowest_m = std::min(lowest_m, seen_m);
    highest_m = std::max(highest_m, seen_m);
  }
  // The rows of a column leave one after the other, while the body moves by up to 2 cm.
  EXPECT_LT(farthest_off_m, 0.02) << "a point that is not on the body";
  // Each of the outermost beams represents half a column beyond it.
  return highest_m - lowest_m + expected.pitch_m;
}

double length_of(const report::Picture& picture, const std::string& name) {
  for (const contribution::Dimension& dimension : picture.dimensions) {
    if (dimension.name == name) return dimension.length_m;
  }
  throw std::runtime_error("the picture has no dimension " + name);
}

const std::vector<report::Picture>& pictures_of(const CrossingRun& run) {
  return run.record.sections.at(0).pictures;
}

/// "traffic.northbound, sweep from 1.000 s on"
double begin_of(const report::Picture& picture) {
  const std::size_t digits = picture.caption.find_first_of("0123456789", picture.caption.find(", "));
  double begin_s = -1.0;
  if (digits == std::string::npos || std::sscanf(picture.caption.c_str() + digits, "%lf", &begin_s) != 1)
    throw std::runtime_error("no instant in the caption: " + picture.caption);
  return begin_s;
}

struct Findings {
  int compressed = 0, stretched = 0, without_motion = 0;
  bool operator==(const Findings&) const = default;
};

Findings check(const CrossingRun& run) {
  const Scanner scanner = scanner_of(run.scenario);
  Findings findings;
  for (const report::Picture& picture : pictures_of(run)) {
    SCOPED_TRACE(picture.title + ": " + picture.caption);
    const std::string& name = picture.entities.at(0);
    const double begin_s = begin_of(picture);
    const Body ego = body_of(run, "traffic.ego", begin_s);
    const Body body = body_of(run, name, begin_s);
    const Expected expected = closed_form(scanner, ego, body);
    const bool without_motion = picture.title == "motion ignored";
    EXPECT_GT(picture.points.size(), 100U);
    EXPECT_DOUBLE_EQ(length_of(picture, "true length"), body.length_m);
    if (without_motion) {
      ++findings.without_motion;
      const double remeasured_m =
          measured(scanner, ego, body, expected, picture, [](const auto&) { return 0.0; });
      EXPECT_NEAR(remeasured_m, body.length_m, 0.01 * body.length_m + expected.pitch_m);
      EXPECT_NEAR(length_of(picture, "measured"), remeasured_m, 0.02 + 0.5 * expected.pitch_m);
      continue;
    }
    const auto time_of = [&](const report::SensorPoint& p) {
      return (0.5 - (scanner.left_to_right ? p.azimuth_rad : -p.azimuth_rad) / scanner.horizontal_rad) *
             scanner.period_s;
    };
    const double remeasured_m = measured(scanner, ego, body, expected, picture, time_of);
    const double tolerance_m = 0.01 * expected.length_m + expected.pitch_m;
    EXPECT_NEAR(remeasured_m, expected.length_m, tolerance_m);
    EXPECT_NEAR(length_of(picture, "measured"), expected.length_m, tolerance_m);
    EXPECT_NEAR(length_of(picture, "closed form"), expected.length_m, 0.01);
    EXPECT_NEAR(length_of(picture, "measured"), remeasured_m, 0.02 + 0.5 * expected.pitch_m);
    // The measured length is not the true one: they differ by more than the tolerance.
    EXPECT_GT(std::abs(expected.length_m - body.length_m), tolerance_m);
    ++(expected.length_m > body.length_m ? findings.stretched : findings.compressed);
  }
  return findings;
}

/// The crossing as it is; with an offset of the scanner's task, with whose first release the sweeps begin;
/// and with a high resolution, at which one column is about 2 cm at 20 m, so that the tolerances are smaller.
TEST(Figure8, LengthsOfPassingCarsFollowTheClosedForm) {
  for (const std::vector<std::string>& settings : std::vector<std::vector<std::string>>{
           {},
           {"duration=4 s", "tasks.scanner.offset=9 ms"},
           {"duration=4 s", "tasks.scanner.parameters.columns=1920", "tasks.scanner.parameters.rows=120"}}) {
    SCOPED_TRACE(settings.empty() ? "as it is" : settings.back());
    const CrossingRun run = run_crossing(settings);
    EXPECT_EQ(check(run), (Findings{.compressed = 1, .stretched = 1, .without_motion = 1}));
    if (settings.size() != 2) continue;
    for (const report::Picture& picture : pictures_of(run))
      EXPECT_NE(picture.caption.find(".009 s"), std::string::npos) << picture.caption;
  }
}

TEST(Figure8, LengthsOfPassingCarsAreTrueWithoutMotion) {
  const CrossingRun run = run_crossing({"duration=4 s", "tasks.scanner.parameters.ignore_motion=true"});
  const Scanner scanner = scanner_of(run.scenario);
  int seen_moving = 0;
  for (const report::Picture& picture : pictures_of(run)) {
    if (picture.title == "motion ignored") continue;
    ++seen_moving;
    const double begin_s = begin_of(picture);
    const Body ego = body_of(run, "traffic.ego", begin_s);
    const Body body = body_of(run, picture.entities.at(0), begin_s);
    const double pitch_m = closed_form(scanner, ego, body).pitch_m;
    EXPECT_NEAR(length_of(picture, "measured"), body.length_m, 0.01 * body.length_m + pitch_m)
        << picture.caption;
  }
  EXPECT_EQ(seen_moving, 2);
}

}  // namespace
}  // namespace hil::run
