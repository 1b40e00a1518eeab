// The instants at which bodies enter and leave loops of detectors and regions of expressions, compared with
// closed forms: bodies with constant velocities, turning ones, and ones whose velocity each tick changes.

#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <random>

#include "runtime/expression/relation.hpp"
#include "tests/gpu/runtime/module_fixture.hpp"
#include "tests/support/eventually.hpp"

namespace hil::modules {
namespace {

constexpr std::int64_t ms = 1'000'000;
constexpr std::int64_t period_ns = 10 * ms;
/// The border of a region is about 2 nm thick, and an event has the first nanosecond after it.
constexpr double tolerance_s = 5e-9;
constexpr double not_known = std::numeric_limits<double>::quiet_NaN();

/// `expected_s`: not_known if the output has to be unknown.
void expect_instant(double output, double expected_s, std::int64_t tick) {
  if (std::isnan(expected_s)) {
    EXPECT_TRUE(std::isnan(output)) << output << " s in tick " << tick;
  } else {
    EXPECT_NEAR(output, expected_s, 4 * tolerance_s) << "in tick " << tick;
  }
}

class StandingClock final : public rtstdb::Clock {
 public:
  explicit StandingClock(bool is_virtual) : is_virtual_(is_virtual) {}
  rtstdb::ClockTime now() const noexcept override { return rtstdb::clock_time_ns(1); }
  bool is_virtual() const noexcept override { return is_virtual_; }

 private:
  const bool is_virtual_;
};

/// A loop along x from -1 m to 1 m, with a heading of 0, and the region `gate` of the same shape. Each tick
/// commits a version, unless a test steps without.
class RegionCrossingsTest : public test::ModuleFixture {
 protected:
  RegionCrossingsTest() : ModuleFixture({"body", "other"}) {}

  void SetUp() override { open(true); }
  void open(bool is_virtual) {
    if (world_) TearDown();
    allocation_guard::reset();
    clock_ = std::make_unique<StandingClock>(is_virtual);
    auto opened = rtstdb::Database::open({.clock = is_virtual ? clock_.get() : nullptr});
    ASSERT_TRUE(opened) << opened.error().message;
    database_ = std::move(opened).value();
    world_ = std::make_unique<NamedWorld>(database_.get(), layers_);
    transaction_ = database_->make_transaction({.max_writes = 8});
    tick_ = world_->create("tick", {.mask = 2});
  }
  void TearDown() override {
    EXPECT_EQ(allocation_guard::seen().total(), 0U) << "in the steps";
    transaction_.reset();
    world_.reset();
    database_.reset();
  }

  rtstdb::EntityRow row(const glm::dvec3& p_m, const glm::dvec3& v_mps, const glm::dvec3& size_m) {
    rtstdb::EntityRow made;
    made.geometry = world_->add_geometry(rtstdb::make_box(size_m), "box");
    made.mask = 1;
    made.motion.p_world_m = p_m;
    made.motion.v_world_mps = v_mps;
    return made;
  }
  std::unique_ptr<AnyModule> make_detectors(std::int64_t period = period_ns) {
    auto module = make(*find_module_type("detectors"),
                       "{layers: [body], loops: {gate: {center: [0 m, 0 m, 0 m], size: [2 m, 4 m, 4 m]}, "
                       "far: {center: [500 m, 0 m, 0 m], size: [2 m, 4 m, 4 m]}}}",
                       {.instance = "loops", .period_ns = period, .deadline_ns = period});
    EXPECT_NE(module, nullptr) << diagnostics_.to_text();
    return module;
  }
  std::unique_ptr<AnyModule> make_relations(const std::string& body) {
    const auto relation = [&](expression::RelationKind kind) {
      for (const expression::RelationFunction& function : expression::relation_functions())
        if (function.kind == kind)
          return expression::Relation{.function = &function, .first = {body, {}}, .second = {"gate", {}}};
      return expression::Relation{};
    };
    TaskParameters task{.instance = "relations", .period_ns = period_ns, .deadline_ns = period_ns};
    const Relations relations{
        .all = {relation(expression::RelationKind::crossed_at), relation(expression::RelationKind::inside)},
        .regions = {{.name = {"gate", {}}, .center_m = {}, .size_m = {2.0, 4.0, 4.0}, .carrier = {}}},
        .beams = {}};
    task.relations = &relations;
    auto module = make(*find_module_type("spatial_relations"), "{}", task);
    EXPECT_NE(module, nullptr) << diagnostics_.to_text();
    return module;
  }

  /// Commits a version at the time; with a motion, of the body.
  void commit(std::int64_t time_ns, std::optional<rtstdb::EntityId> body = {},
              const rtstdb::Motion& motion = {}) {
    transaction_->begin({.world_time = rtstdb::world_time_ns(time_ns)});
    transaction_->update(tick_, {.mask = 2});
    if (body) transaction_->update_motion(*body, motion);
    ASSERT_TRUE(database_->execute(*transaction_).done());
  }
  std::vector<double> step(AnyModule& module, std::int64_t time_ns) {
    return ModuleFixture::step(module, 0, time_ns, period_ns);
  }
  /// A commit and a step at each tick.
  std::vector<std::vector<double>> run(AnyModule& module, std::int64_t ticks) {
    std::vector<std::vector<double>> outputs;
    for (std::int64_t tick = 0; tick < ticks; ++tick) {
      commit(tick * period_ns);
      outputs.push_back(step(module, tick * period_ns));
    }
    return outputs;
  }
  /// "entered" and "left" of the loop `gate` in the report.
  static std::array<double, 2> counts(const AnyModule& module) {
    contribution::Contribution report;
    module.contribute(report);
    const auto& row = report.sections.at(0).tables.at(0).rows.at(0);
    EXPECT_EQ(row.at(0).text, "gate");
    return {row.at(1).number, row.at(2).number};
  }

  std::unique_ptr<StandingClock> clock_;
  std::unique_ptr<rtstdb::Transaction> transaction_;
  rtstdb::EntityId tick_;
};

/// Outputs of the detectors: gate, far, gate.entered_at, gate.left_at, far.entered_at, far.left_at.
TEST_F(RegionCrossingsTest, DetectorsHaveTheInstantsOfBodiesWithAKnownVelocity) {
  // Its front is at 3.005 m - 10 m/s t, its rear 1 m behind.
  world_->create("car", row({3.505, 0.0, 0.0}, {-10.0, 0.0, 0.0}, {1.0, 1.0, 1.0}));
  const auto module = make_detectors();
  const auto outputs = run(*module, 60);
  for (std::int64_t tick = 0; tick < 60; ++tick) {
    const double t_s = 0.01 * static_cast<double>(tick);
    const auto& now = outputs[static_cast<std::size_t>(tick)];
    EXPECT_EQ(now[0], t_s > 0.2005 && t_s < 0.5005 ? 1.0 : 0.0) << tick;
    expect_instant(now[2], t_s > 0.2005 ? 0.2005 : not_known, tick);
    expect_instant(now[3], t_s > 0.5005 ? 0.5005 : not_known, tick);
    EXPECT_EQ(now[1], 0.0);
    EXPECT_TRUE(std::isnan(now[4]) && std::isnan(now[5])) << tick;
  }
  EXPECT_EQ(counts(*module), (std::array<double, 2>{1.0, 1.0}));
}

TEST_F(RegionCrossingsTest, RandomBodiesCrossAtTheirInstants) {
  std::mt19937 random(75);
  const auto from = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  constexpr int bodies = 40;
  std::vector<double> enters(bodies), leaves(bodies);
  for (int k = 0; k < bodies; ++k) {
    const double half_m = from(0.1, 2.0), speed_mps = from(0.5, 60.0), enters_s = from(0.02, 0.9);
    const double side = k % 2 == 0 ? 1.0 : -1.0;
    // The near face reaches the border at 1 m after enters_s, the far face the other border.
    const double x_m = side * (1.0 + half_m + speed_mps * enters_s);
    world_->create("body" + std::to_string(k),
                   row({x_m, from(-1.5, 1.5), from(-1.5, 1.5)}, {-side * speed_mps, 0.0, 0.0},
                       {2.0 * half_m, from(0.1, 1.0), from(0.1, 1.0)}));
    // The mesh has single precision.
    const double near_m = static_cast<double>(static_cast<float>(half_m));
    enters[static_cast<std::size_t>(k)] = (std::abs(x_m) - near_m - 1.0) / speed_mps;
    leaves[static_cast<std::size_t>(k)] = (std::abs(x_m) + near_m + 1.0) / speed_mps;
  }
  const auto module = make_detectors();
  const auto relations = make_relations("body0");
  for (std::int64_t tick = 0; tick < 100; ++tick) {
    commit(tick * period_ns);
    const auto now = step(*module, tick * period_ns);
    const double t_s = 0.01 * static_cast<double>(tick);
    const auto last_of = [&](const std::vector<double>& instants) {
      double last = not_known;
      for (const double instant : instants)
        if (instant < t_s && !(last > instant)) last = instant;
      return last;
    };
    expect_instant(now[2], last_of(enters), tick);
    expect_instant(now[3], last_of(leaves), tick);
    const auto of_body = step(*relations, tick * period_ns);
    expect_instant(of_body[0], last_of({enters[0], leaves[0]}), tick);
    EXPECT_EQ(of_body[1], enters[0] < t_s && t_s < leaves[0] ? 1.0 : 0.0) << tick;
  }
  std::array<double, 2> expected{};
  for (std::size_t k = 0; k < bodies; ++k) {
    expected[0] += enters[k] < 0.99 ? 1.0 : 0.0;
    expected[1] += leaves[k] < 0.99 ? 1.0 : 0.0;
  }
  EXPECT_EQ(counts(*module), expected);
  EXPECT_GT(expected[1], 10.0);
}

/// A bar of 4 m by 2 m that turns in its place enters where its corner reaches the border.
TEST_F(RegionCrossingsTest, ATurningBodyCrossesWhereItsCornerReachesTheBorder) {
  constexpr double rate_radps = 0.7, gap_m = 2.125;
  rtstdb::EntityRow bar = row({1.0 + gap_m, 0.0, 0.0}, {}, {4.0, 2.0, 1.0});
  bar.motion.q_world = glm::angleAxis(glm::half_pi<double>(), glm::dvec3(0.0, 0.0, 1.0));
  bar.motion.w_world_radps = {0.0, 0.0, rate_radps};
  world_->create("bar", bar);
  const auto module = make_detectors();
  const auto outputs = run(*module, 350);
  // Its extent along x is |2 m sin a| + |1 m cos a| = sqrt(5) m cos(a - atan(2)), at the angle a from the
  // start, and at most sqrt(5) m.
  const double middle_rad = std::atan(2.0), reach_rad = std::acos(gap_m / std::sqrt(5.0));
  const double first_s = (middle_rad - reach_rad) / rate_radps,
               second_s = (middle_rad + reach_rad) / rate_radps;
  // The other diagonal follows.
  const double third_s = (glm::pi<double>() - middle_rad - reach_rad) / rate_radps;
  ASSERT_LT(first_s, second_s);
  ASSERT_LT(second_s, third_s);
  for (std::int64_t tick = 0; tick < 350; ++tick) {
    const double t_s = 0.01 * static_cast<double>(tick);
    const auto& now = outputs[static_cast<std::size_t>(tick)];
    expect_instant(now[2], t_s < first_s ? not_known : t_s < third_s ? first_s : third_s, tick);
    if (t_s < third_s) expect_instant(now[3], t_s < second_s ? not_known : second_s, tick);
  }
  EXPECT_EQ(counts(*module)[0], 2.0);
}

/// Each tick writes the place and the mean velocity until the next tick, so the body follows its path in
/// straight pieces.
TEST_F(RegionCrossingsTest, AnAcceleratedBodyCrossesWithinThePieceOfItsTick) {
  constexpr double a_mps2 = 7.3, half_m = 0.5;
  const auto x_m = [](std::int64_t tick) {
    const double t_s = 0.01 * static_cast<double>(tick);
    return -4.2 + 0.5 * a_mps2 * t_s * t_s;
  };
  const auto body = world_->create("body", row({x_m(0), 0.0, 0.0}, {}, {1.0, 1.0, 1.0}));
  const auto module = make_detectors();
  const auto relations = make_relations("body");
  std::vector<double> expected;  // enters, leaves
  for (const double border_m : {-1.0 - half_m, 1.0 + half_m}) {
    std::int64_t tick = 0;
    while (x_m(tick + 1) < border_m)
      ++tick;
    const double v_mps = (x_m(tick + 1) - x_m(tick)) / 0.01;
    expected.push_back(0.01 * static_cast<double>(tick) + (border_m - x_m(tick)) / v_mps);
  }
  for (std::int64_t tick = 0; tick < 150; ++tick) {
    rtstdb::Motion motion;
    motion.p_world_m = {x_m(tick), 0.0, 0.0};
    motion.v_world_mps = {(x_m(tick + 1) - x_m(tick)) / 0.01, 0.0, 0.0};
    motion.valid_from = rtstdb::world_time_ns(tick * period_ns);
    commit(tick * period_ns, body, motion);
    const auto now = step(*module, tick * period_ns);
    const auto of_body = step(*relations, tick * period_ns);
    const double t_s = 0.01 * static_cast<double>(tick);
    const double entered = t_s > expected[0] ? expected[0] : not_known;
    const double left = t_s > expected[1] ? expected[1] : not_known;
    expect_instant(now[2], entered, tick);
    expect_instant(now[3], left, tick);
    expect_instant(of_body[0], std::isnan(left) ? entered : left, tick);
  }
  ASSERT_LT(expected[1], 1.49);
}

TEST_F(RegionCrossingsTest, ABodyThatPassesBetweenTwoTicksIsCounted) {
  // 500 m/s: it is over the loop for 6 ms, from 12.002 ms on.
  world_->create("dart", row({7.501, 0.0, 0.0}, {-500.0, 0.0, 0.0}, {1.0, 1.0, 1.0}));
  const auto module = make_detectors();
  const auto relations = make_relations("dart");
  for (std::int64_t tick = 0; tick < 5; ++tick) {
    commit(tick * period_ns);
    const auto now = step(*module, tick * period_ns);
    const auto of_body = step(*relations, tick * period_ns);
    EXPECT_EQ(now[0], 0.0) << "no tick sees it over the loop";
    EXPECT_EQ(of_body[1], 0.0);
    if (tick < 2) {
      EXPECT_TRUE(std::isnan(now[2]) && std::isnan(now[3]) && std::isnan(of_body[0]));
    } else {
      EXPECT_NEAR(now[2], 0.012002, tolerance_s);
      EXPECT_NEAR(now[3], 0.018002, tolerance_s);
      EXPECT_NEAR(of_body[0], 0.018002, tolerance_s);
    }
  }
  EXPECT_EQ(counts(*module), (std::array<double, 2>{1.0, 1.0}));
}

TEST_F(RegionCrossingsTest, AnInstantIsUnknownUntilALaterVersionMakesItFinal) {
  // Over the loop from 0.1 s to 0.4 s.
  const auto body = world_->create("car", row({2.5, 0.0, 0.0}, {-10.0, 0.0, 0.0}, {1.0, 1.0, 1.0}));
  const auto module = make_detectors();
  const auto relations = make_relations("car");
  commit(0);
  const auto at = [&](std::int64_t time_ns) {
    auto outputs = step(*module, time_ns);
    const auto of_body = step(*relations, time_ns);
    outputs.insert(outputs.end(), of_body.begin(), of_body.end());
    return outputs;
  };
  auto now = at(200 * ms);
  EXPECT_EQ(now[0], 1.0) << "membership is that of the instant";
  EXPECT_TRUE(std::isnan(now[2]) && std::isnan(now[6]));
  commit(210 * ms);
  now = at(210 * ms);
  EXPECT_NEAR(now[2], 0.1, tolerance_s);
  EXPECT_NEAR(now[6], 0.1, tolerance_s);
  now = at(300 * ms);
  EXPECT_NEAR(now[2], 0.1, tolerance_s) << "it was made final, and the body is still there";
  EXPECT_NEAR(now[6], 0.1, tolerance_s);
  now = at(500 * ms);
  EXPECT_EQ(now[0], 0.0);
  EXPECT_NEAR(now[2], 0.1, tolerance_s) << "no other body has entered";
  EXPECT_TRUE(std::isnan(now[3])) << "it has left, and no version says when";
  EXPECT_TRUE(std::isnan(now[6])) << "its last crossing is not that of 0.1 s";
  // It comes back by a write, which is no motion over the border.
  rtstdb::Motion back;
  back.v_world_mps.x = 10.0;
  back.valid_from = rtstdb::world_time_ns(600 * ms);
  commit(600 * ms, body, back);
  now = at(600 * ms);
  EXPECT_NEAR(now[3], 0.4, tolerance_s);
  EXPECT_NEAR(now[2], 0.6, tolerance_s);
  EXPECT_NEAR(now[6], 0.6, tolerance_s);
  now = at(900 * ms);
  EXPECT_NEAR(now[2], 0.6, tolerance_s);
  EXPECT_TRUE(std::isnan(now[3])) << "the instant of 0.4 s is not that at which it left last";
  EXPECT_TRUE(std::isnan(now[6]));
  commit(910 * ms);
  now = at(910 * ms);
  EXPECT_NEAR(now[3], 0.75, tolerance_s);
  EXPECT_NEAR(now[6], 0.75, tolerance_s);
  EXPECT_EQ(counts(*module), (std::array<double, 2>{2.0, 2.0}));
}

TEST_F(RegionCrossingsTest, BodiesOfTheStartHaveNotEntered) {
  world_->create("before", row({0.0, 0.0, 0.0}, {}, {1.0, 1.0, 1.0}));
  const auto module = make_detectors();
  world_->create("after", row({0.5, 0.0, 0.0}, {5.0, 0.0, 0.0}, {1.0, 1.0, 1.0}));
  const auto outputs = run(*module, 40);
  EXPECT_EQ(outputs.front()[0], 2.0);
  EXPECT_TRUE(std::isnan(outputs.back()[2]));
  EXPECT_NEAR(outputs.back()[3], 0.2, tolerance_s);
  EXPECT_EQ(counts(*module), (std::array<double, 2>{0.0, 1.0}));
}

/// A step on a task thread reads the version of its release, whatever is committed while it runs.
TEST_F(RegionCrossingsTest, AStepTakesNoCrossingOfAVersionAfterItsOwn) {
  world_->create("car", row({2.5, 0.0, 0.0}, {-10.0, 0.0, 0.0}, {1.0, 1.0, 1.0}));
  const auto module = make_detectors();
  commit(90 * ms);
  const rtstdb::Version old = database_->latest().version;
  commit(110 * ms);
  const auto step_at = [&](rtstdb::Version version, std::int64_t time_ns) {
    std::vector<double> outputs(module->ports().outputs.size());
    WorldStep context;
    context.time_ns = time_ns;
    context.deadline = rtstdb::ClockTime::max();
    context.version = version;
    context.outputs = outputs;
    context.events = &events_;
    module->world_module()->step(context);
    return outputs;
  };
  EXPECT_TRUE(std::isnan(step_at(old, 90 * ms)[2]));
  EXPECT_NEAR(step_at(old + 1, 110 * ms)[2], 0.1, tolerance_s);
}

/// With more crossings between two steps than the query keeps, the instants are unknown until the next one,
/// an event has their number, and two runs are alike.
TEST_F(RegionCrossingsTest, LostCrossingsMakeInstantsUnknownAndAreNoted) {
  std::vector<std::string> runs;
  for (int repetition = 0; repetition < 2; ++repetition) {
    open(true);
    const auto body = world_->create("car", row({9.0, 0.0, 0.0}, {}, {1.0, 1.0, 1.0}));
    const auto module = make_detectors();
    const auto jump = [&](std::int64_t time_ns, bool is_over) {
      rtstdb::Motion motion;
      motion.p_world_m.x = is_over ? 0.0 : 9.0;
      motion.valid_from = rtstdb::world_time_ns(time_ns);
      commit(time_ns, body, motion);
    };
    std::string text;
    const auto note = [&](std::int64_t time_ns) {
      for (const double output : step(*module, time_ns))
        text += std::to_string(output) + " ";
    };
    for (std::int64_t k = 1; k <= 1500; ++k)
      jump(k * ms, k % 2 == 1);
    note(1500 * ms);
    jump(1501 * ms, true);
    note(1501 * ms);
    jump(1502 * ms, false);
    note(1502 * ms);
    EXPECT_TRUE(text.starts_with("0.000000 0.000000 nan nan nan nan 1.000000 0.000000 nan nan nan nan "))
        << text;
    EXPECT_TRUE(text.ends_with("0.000000 0.000000 nan 1.502000 nan nan ")) << text;
    runs.push_back(text);
  }
  EXPECT_EQ(runs[0], runs[1]);
  // The query keeps 1024 events, of which two were the empty list of the start.
  const auto events = events_.events();
  ASSERT_EQ(events.size(), 2u);
  for (const RunEvents::Event& event : events)
    EXPECT_EQ(event.text, "module loops: 479 crossings of loop gate were lost");
}

/// In real time nothing waits for the follower: an instant is known soon after the version that makes it
/// final.
TEST_F(RegionCrossingsTest, InRealTimeAnInstantComesSoon) {
  open(false);
  world_->create("car", row({2.5, 0.0, 0.0}, {-10.0, 0.0, 0.0}, {1.0, 1.0, 1.0}));
  const auto module = make_detectors();
  commit(110 * ms);
  double entered = 0.0;
  EXPECT_TRUE(tests::eventually([&] { return !std::isnan(entered = step(*module, 110 * ms)[2]); }));
  EXPECT_NEAR(entered, 0.1, tolerance_s);
}

}  // namespace
}  // namespace hil::modules
