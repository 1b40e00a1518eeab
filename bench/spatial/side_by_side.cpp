#include "bench/spatial/side_by_side.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <thread>

namespace hil::bench {

void limit_software_device() {
  setenv("LP_NUM_THREADS", std::to_string(threads_per_side).c_str(), 0);
}

double seconds_of(const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

RoundTimes once_each(bool we_begin, const std::function<void()>& ours, const std::function<void()>& theirs) {
  RoundTimes times;
  if (we_begin) times.ours_s.push_back(seconds_of(ours));
  times.theirs_s.push_back(seconds_of(theirs));
  if (!we_begin) times.ours_s.push_back(seconds_of(ours));
  return times;
}

RoundTimes in_turns(int rounds, const std::function<void()>& ours, const std::function<void()>& theirs) {
  ours();
  theirs();
  RoundTimes times;
  for (int round = 0; round < rounds; ++round) {
    const RoundTimes once = once_each(round % 2 == 0, ours, theirs);
    times.ours_s.push_back(once.ours_s.front());
    times.theirs_s.push_back(once.theirs_s.front());
  }
  return times;
}

void over_chunks(std::size_t count, std::size_t chunk,
                 const std::function<void(std::size_t begin, std::size_t end)>& each) {
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t begin = next.fetch_add(chunk); begin < count; begin = next.fetch_add(chunk))
      each(begin, std::min(begin + chunk, count));
  };
  std::vector<std::thread> others;
  for (unsigned i = 1; i < threads_per_side; ++i)
    others.emplace_back(work);
  work();
  for (std::thread& other : others)
    other.join();
}

std::vector<Figure> rates(const RateComparison& comparison) {
  std::vector<double> device_s;
  const RoundTimes times = in_turns(
      comparison.rounds, [&] { device_s.push_back(comparison.ours()); }, comparison.theirs);
  device_s.erase(device_s.begin());  // removes the warm-up round
  const auto rate = [&](const std::vector<double>& seconds) {
    return static_cast<double>(comparison.things) / median(seconds) / comparison.unit.things;
  };
  const auto samples = static_cast<std::uint64_t>(comparison.rounds);
  return {{comparison.name, rate(times.ours_s), comparison.unit.name, comparison.peer, rate(times.theirs_s),
           Better::higher, samples},
          {comparison.name + "_device", rate(device_s), comparison.unit.name, "", std::nullopt,
           Better::higher, samples}};
}

Figure time_figure(const std::string& name, const RoundTimes& times, const std::string& peer) {
  Figure figure{name,          1e3 * median(times.ours_s), "ms", peer, std::nullopt,
                Better::lower, times.ours_s.size()};
  if (!times.theirs_s.empty()) figure.theirs = 1e3 * median(times.theirs_s);
  return figure;
}

}  // namespace hil::bench
