#include "bench/executive/judge_frames.hpp"

#include <algorithm>
#include <chrono>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bench/figure/figure.hpp"
#include "io/device.hpp"
#include "runtime/config/parse.hpp"
#include "runtime/expectations/every_tick.hpp"
#include "runtime/expectations/judges.hpp"
#include "runtime/signals/signal_expression.hpp"

namespace hil::bench {
namespace {

constexpr std::int64_t period_ns = 1'000'000;
constexpr std::size_t frames_per_tick = 4'096;
constexpr int conditions = 20;

/// Hands out frames of two signals: a counter from 0 to 99, and a level.
class FrameSource final : public io::Device, public io::ArrivalSource {
 public:
  const std::string& name() const noexcept override { return name_; }
  std::span<const io::ChannelInfo> inputs() const noexcept override { return {}; }
  std::span<const io::InputGroup> input_groups() const noexcept override { return {}; }
  io::RunTimeNs loss_timeout_ns() const noexcept override { return 0; }
  std::span<const io::ChannelInfo> outputs() const noexcept override { return {}; }
  void start(const io::RunClock& /*clock*/, io::Pacing /*pacing*/) override {}
  void latch_inputs(std::span<io::Sample> /*samples*/) noexcept override {}
  void release_outputs(std::span<const double> /*values*/, io::RunTimeNs /*tick_ns*/) noexcept override {}
  bool exchange(io::RunTimeNs /*tick_ns*/) override { return true; }
  void enter_safe_state() noexcept override {}
  void stop() noexcept override {}
  bool connected() const noexcept override { return true; }
  std::string fault() const override { return {}; }
  std::string send_fault() const override { return {}; }

  void receive(std::size_t count, std::int64_t from_ns) {
    left_ = count;
    time_ns_ = from_ns;
  }
  io::ArrivalSource* arrival_source() noexcept override { return this; }
  bool keep_arrivals(std::size_t /*input*/) override { return true; }
  std::uint64_t lost_arrivals() const noexcept override { return 0; }
  std::optional<io::Arrival> next_arrival(std::span<io::InputValue> values) noexcept override {
    if (left_ == 0) return std::nullopt;
    --left_;
    values[0] = {0, static_cast<double>(number_++ % 100)};
    values[1] = {1, 0.5};
    time_ns_ += 200;
    return io::Arrival{time_ns_, 2};
  }

 private:
  const std::string name_ = "frames";
  std::size_t left_ = 0;
  std::uint64_t number_ = 0;
  std::int64_t time_ns_ = 0;
};

config::Expression parsed(const std::string& text) {
  config::Diagnostics diagnostics;
  const auto value = config::parse_text("condition", '"' + text + '"', config::Schema::text(), diagnostics);
  auto expression = config::Expression::parse(value.value(), diagnostics);
  if (!expression) throw std::runtime_error(diagnostics.to_text());
  return std::move(*expression);
}

class Average final : public expectations::ComputedSignals {
 public:
  explicit Average(signals::SignalTable& table)
      : signal_(table.add({.name = "average", .unit = "", .writer = "variables"})) {
    config::Diagnostics diagnostics;
    expression_ =
        signals::SignalExpression::compile(parsed("lag(can.car.Status.Level, 20 ms)"), table, {.unit = ""},
                                           {.period_ns = period_ns, .seed = 1}, diagnostics);
    if (!expression_) throw std::runtime_error(diagnostics.to_text());
  }
  std::vector<std::uint32_t> numbers_reading(std::span<const signals::SignalId> signals) const override {
    return signals.front() == expression_->signals().front() ? std::vector<std::uint32_t>{0}
                                                             : std::vector<std::uint32_t>{};
  }
  std::vector<signals::SignalId> with_sources(std::vector<signals::SignalId> signals) const override {
    if (std::ranges::find(signals, signal_) != signals.end())
      signals.push_back(expression_->signals().front());
    return signals;
  }
  void update_at_frame(signals::SignalTable& table, std::int64_t time_ns,
                       std::span<const std::uint32_t> numbers) noexcept override {
    if (numbers.empty()) return;
    table.write(
        signal_,
        expression_->evaluate(table, {.time_ns = time_ns, .is_tick = false}, signals::Unpublished::unknown),
        time_ns);
  }

 private:
  const signals::SignalId signal_;
  std::optional<signals::SignalExpression> expression_;
};

}  // namespace

JudgeFramesCost measure_judge_frames(std::uint64_t ticks) {
  signals::SignalTable table;
  const signals::SignalId counter =
      table.add({.name = "can.car.Status.Counter", .unit = "", .writer = "can.car", .arrives = true});
  const signals::SignalId level =
      table.add({.name = "can.car.Status.Level", .unit = "", .writer = "can.car", .arrives = true});
  Average average(table);
  config::Scenario scenario;
  scenario.base_period_ns = period_ns;
  scenario.duration_ticks = ticks;
  for (int i = 0; i < conditions; ++i) {
    const std::string number = std::to_string(i);
    const std::string text = "can.car.Status.Counter == " + number +
                             " and duration(can.car.Status.Level > 0.4) >= 0 ms and average < 1 and " +
                             "can.car.Status.Level < " + number;
    config::Expectation& expectation = scenario.expectations.emplace_back();
    expectation.name = number;
    expectation.claim = expectations::claim_of(expectations::Never{parsed(text)});
  }
  FrameSource device;
  const signals::Links links{.inputs = {counter, level}, .outputs = {}, .connected = {}, .fresh = {}};
  expectations::Arrivals arrivals;
  arrivals.keep(device, links, counter);
  arrivals.keep(device, links, level);
  expectations::Judges judges(scenario, table, arrivals, average);
  JudgeFramesCost cost{.median_us = 0.0, .ticks = ticks};
  std::vector<double> ticks_us;
  for (std::uint64_t tick = 0; tick < ticks; ++tick) {
    const auto time_ns = static_cast<std::int64_t>(tick + 1) * period_ns;
    device.receive(frames_per_tick, time_ns - period_ns);
    const auto begin = std::chrono::steady_clock::now();
    judges.check_frames(time_ns);
    judges.check(table, time_ns);
    const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - begin;
    ticks_us.push_back(took.count());
  }
  report::RunRecord record;
  judges.fill(
      {.end_ns = static_cast<std::int64_t>(ticks) * period_ns, .ticks = ticks, .period_ns = period_ns},
      record);
  // Level is 0.5, so all but the first condition are true at the frames with their number.
  for (int i = 0; i < conditions; ++i) {
    const bool is_broken = record.expectations[static_cast<std::size_t>(i)].first_failure_ns.has_value();
    if (is_broken != (i > 0)) throw std::runtime_error("judge_frames: condition " + std::to_string(i));
  }
  cost.median_us = median(std::move(ticks_us));
  return cost;
}

}  // namespace hil::bench
