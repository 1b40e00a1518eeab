// The paper's Figure 8 on the repository's own crossing: the apparent length of a passing car, measured from
// the scan, against the closed form, for both directions of travel; without motion it has its true length.
//
// Everything that is expected is worked out here, from the scenario's numbers and from where signals.csv says
// the bodies were; of the run's own comparison the points are taken, measured again, and its figures held
// against that.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "tests/unit/runtime_run/crossing_run.hpp"

namespace hil::run {
namespace {

using testing::CrossingRun;
using testing::run_crossing;

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

/// A body during a sweep; time counts from the sweep's begin. It does not turn.
struct Body {
  const CrossingRun& run;
  std::string name;
  double begin_s = 0.0;
  Point travel;
  double length_m = 0.0, width_m = 0.0;

  /// Where signals.csv says it was.
  Point center(double t_s) const {
    return {run.signals.at(name + ".x", begin_s + t_s), run.signals.at(name + ".y", begin_s + t_s)};
  }
  /// A point of it, so far ahead of its middle and to its left.
  Point at(double ahead_m, double left_m, double t_s) const {
    return center(t_s) + ahead_m * travel + left_m * Point{-travel.y_m, travel.x_m};
  }
};

/// What this test knows of the scanner, from the scenario.
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

/// In the sensor's axes, which are the ego's.
Point turned(const Body& ego, const Point& d) {
  return {d.x_m * ego.travel.x_m + d.y_m * ego.travel.y_m, -d.x_m * ego.travel.y_m + d.y_m * ego.travel.x_m};
}

Point seen(const Scanner& scanner, const Body& ego, const Point& p, double t_s) {
  return turned(ego, p + (-1.0) * ego.at(scanner.mount_x_m, scanner.mount_y_m, t_s));
}

/// When the turning beam meets that point of the body: the time at which it looks where the point is then.
double meeting_s(const Scanner& scanner, const Body& ego, const Body& body, double ahead_m, double left_m) {
  double t_s = 0.5 * scanner.period_s;
  for (int i = 0; i < 200; ++i) {
    const Point at = seen(scanner, ego, body.at(ahead_m, left_m, t_s), t_s);
    const double azimuth = std::atan2(at.y_m, at.x_m);
    const double share = 0.5 - (scanner.left_to_right ? azimuth : -azimuth) / scanner.horizontal_rad;
    t_s += 0.5 * (std::clamp(share, 0.0, 1.0) * scanner.period_s - t_s);  // damped, so that it settles
  }
  return t_s;
}

struct Expected {
  double length_m = 0.0;  // the closed form
  double pitch_m = 0.0;   // one column on the body's side, at the edge where it covers more
};

/// The side facing the sensor from its rear edge to its front edge, each where the beam meets it.
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

/// The picture's points that lie on the body's side, measured again along its direction of travel. `t_of`
/// tells when a point was taken.
template <typename TimeOf>
double measured(const Scanner& scanner, const Body& ego, const Body& body, const Expected& expected,
                const report::Picture& picture, TimeOf t_of) {
  double least = 1e300;
  double most = -1e300;
  double farthest_off_m = 0.0;
  const Point along = turned(ego, body.travel);
  for (const report::SensorPoint& p : picture.points) {
    const double t_s = t_of(p);
    // Beside the body at that instant: is it on one of its long sides?
    const Point middle = seen(scanner, ego, body.center(t_s), t_s);
    const Point d{p.x_m - middle.x_m, p.y_m - middle.y_m};
    const double ahead_m = d.x_m * along.x_m + d.y_m * along.y_m;
    const double beside_m = std::abs(-d.x_m * along.y_m + d.y_m * along.x_m) - 0.5 * body.width_m;
    farthest_off_m = std::max({farthest_off_m, beside_m, std::abs(ahead_m) - 0.5 * body.length_m});
    if (beside_m < -0.02 || std::abs(ahead_m) > 0.5 * body.length_m - 1e-4) continue;
    // As it seems to whoever takes the points for one instant's.
    const double seen_m = p.x_m * along.x_m + p.y_m * along.y_m;
    least = std::min(least, seen_m);
    most = std::max(most, seen_m);
  }
  // A column's rows leave one after the other: it moves on by 2 cm meanwhile.
  EXPECT_LT(farthest_off_m, 0.02) << "a point that is not on the body";
  // The outermost beams stand for half a column beyond them.
  return most - least + expected.pitch_m;
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
  int compressed = 0, stretched = 0, still = 0;
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
    const bool still = picture.title == "motion ignored";
    EXPECT_GT(picture.points.size(), 100U);
    EXPECT_DOUBLE_EQ(length_of(picture, "true length"), body.length_m);
    if (still) {
      ++findings.still;
      const double again_m = measured(scanner, ego, body, expected, picture, [](const auto&) { return 0.0; });
      EXPECT_NEAR(again_m, body.length_m, 0.01 * body.length_m + expected.pitch_m);
      EXPECT_NEAR(length_of(picture, "measured"), again_m, 0.02 + 0.5 * expected.pitch_m);
      continue;
    }
    const auto time_of = [&](const report::SensorPoint& p) {
      return (0.5 - (scanner.left_to_right ? p.azimuth_rad : -p.azimuth_rad) / scanner.horizontal_rad) *
             scanner.period_s;
    };
    const double again_m = measured(scanner, ego, body, expected, picture, time_of);
    const double tolerance_m = 0.01 * expected.length_m + expected.pitch_m;
    EXPECT_NEAR(again_m, expected.length_m, tolerance_m);
    EXPECT_NEAR(length_of(picture, "measured"), expected.length_m, tolerance_m);
    EXPECT_NEAR(length_of(picture, "closed form"), expected.length_m, 0.01);
    EXPECT_NEAR(length_of(picture, "measured"), again_m, 0.02 + 0.5 * expected.pitch_m);
    // It is not the true length that was measured: the two differ by more than the tolerance.
    EXPECT_GT(std::abs(expected.length_m - body.length_m), tolerance_m);
    ++(expected.length_m > body.length_m ? findings.stretched : findings.compressed);
  }
  return findings;
}

TEST(Figure8, TheCrossingAsItIsShowsBothDirectionsAndTheTrueLength) {
  const CrossingRun run = run_crossing({});
  const Findings found = check(run);
  EXPECT_EQ(found.compressed, 1);
  EXPECT_EQ(found.stretched, 1);
  EXPECT_EQ(found.still, 1);
}

/// Sweeps begin with the scanner's first release, and each is a whole number of its steps.
TEST(Figure8, ATaskWithAnOffsetScansWholeSweepsTheSame) {
  const CrossingRun run = run_crossing({"duration=4 s", "tasks.scanner.offset=9 ms"});
  const Findings found = check(run);
  EXPECT_EQ(found.compressed, 1);
  EXPECT_EQ(found.stretched, 1);
  EXPECT_EQ(found.still, 1);
  for (const report::Picture& picture : pictures_of(run))
    EXPECT_NE(picture.caption.find(".009 s"), std::string::npos) << picture.caption;
}

/// Where one column is small (about 2 cm at 20 m) the closed form is met as closely.
TEST(Figure8, AtAHighResolutionTheClosedFormIsMetMoreClosely) {
  const CrossingRun run = run_crossing(
      {"duration=4 s", "tasks.scanner.parameters.columns=1920", "tasks.scanner.parameters.rows=120"});
  const Findings found = check(run);
  EXPECT_EQ(found.compressed, 1);
  EXPECT_EQ(found.stretched, 1);
  EXPECT_EQ(found.still, 1);
}

TEST(Figure8, WithMotionIgnoredThePassingCarsHaveTheirTrueLength) {
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
