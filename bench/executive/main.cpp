// hil-bench-executive [--json] [--tiny]: wake-up latency compared with cyclictest, the cost of a tick, that
// of a step of a block, that of a recording in the tick, that of judging 4,096 frames in a tick, and that
// of a tick of a whole bench.

#include <cstdio>
#include <exception>
#include <string>
#include <string_view>

#include "bench/executive/bench_tick.hpp"
#include "bench/executive/block_step.hpp"
#include "bench/executive/judge_frames.hpp"
#include "bench/executive/recording_step.hpp"
#include "bench/executive/wakeup.hpp"
#include "bench/figure/figure.hpp"

namespace {

int run(bool json, bool tiny) {
  using namespace hil::bench;
  ComparisonOptions options;
  if (tiny) {
    options.rounds = 1;
    options.ticks_per_round = 200;
  }
  const std::string peer = cyclictest_version();
  const WakeupComparison wakeup = compare_wakeup(options);
  for (const std::string& sentence : wakeup.degraded)
    std::fprintf(stderr, "degraded: %s\n", sentence.c_str());
  const TickOverhead overhead = measure_tick_overhead(options);
  const BlockStepCost block = measure_block_step(options.rounds, options.ticks_per_round);
  const RecordingCost recording = measure_recording(options.rounds, options.ticks_per_round);
  const JudgeFramesCost judge_frames = measure_judge_frames(200);
  const BenchTick bench_tick = measure_bench_tick(options.rounds, options.ticks_per_round);
  const std::string device = device_name();
  const Figure figures[] = {
      {"wakeup_p50", wakeup.ours.p50_us, "us", peer, wakeup.theirs.p50_us, Better::lower,
       wakeup.ours.samples},
      {"wakeup_p99", wakeup.ours.p99_us, "us", peer, wakeup.theirs.p99_us, Better::lower,
       wakeup.ours.samples},
      {"tick_overhead_10_tasks", overhead.median_us, "us", "", std::nullopt, Better::lower, overhead.samples},
      {"bench_tick", bench_tick.median_us, "us", "", std::nullopt, Better::lower, bench_tick.ticks},
      {"block_10_states", block.median_us, "us", "", std::nullopt, Better::lower, block.steps},
      {"judge_frames", judge_frames.median_us, "us", "", std::nullopt, Better::lower, judge_frames.ticks},
      {"recording_200_signals", recording.median_us, "us", "", std::nullopt, Better::lower, recording.ticks},
  };
  for (const Figure& figure : figures) {
    std::printf("%s\n", (json ? as_json_line(figure, device) : as_text_line(figure)).c_str());
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  bool json = false;
  bool tiny = false;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--json") {
      json = true;
    } else if (argument == "--tiny") {
      tiny = true;
    } else {
      std::fprintf(stderr, "hil-bench-executive: unknown argument '%s'; known: --json, --tiny\n", argv[i]);
      return 2;
    }
  }
  try {
    return run(json, tiny);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "hil-bench-executive: %s\n", error.what());
    return 1;
  }
}
