// The verifier in Python was written from the format alone and shares no code. It must read the same rows and
// refuse the same logs.

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <random>

#include "rtstdb/log/posix_disk.hpp"
#include "rtstdb/log/writer.hpp"
#include "sample_log.hpp"
#include "tests/paths.h"
#include "tests/support/simulation/clock.hpp"
#include "tests/support/simulation/disk.hpp"
#include "tests/support/temporary_folder.hpp"

namespace rtstdb::log::test {
namespace {

std::string output_of(const std::string& command) {
  std::string output;
  FILE* pipe = ::popen(command.c_str(), "r");
  if (pipe == nullptr) return output;
  std::array<char, 4096> part;
  for (std::size_t count = 0; (count = std::fread(part.data(), 1, part.size(), pipe)) > 0;)
    output.append(part.data(), count);
  ::pclose(pipe);
  return output;
}

class VerifierTest : public testing::Test {
 protected:
  std::filesystem::path directory(std::size_t number) const { return folder_ / std::to_string(number); }

  /// Adds a directory for the verifier and its expected output.
  void add(const Contents& contents) {
    const auto folder = directory(expected_.size());
    std::filesystem::create_directories(folder);
    for (const auto& [name, bytes] : contents) {
      std::ofstream file(folder / name, std::ios::binary);
      file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    }
    expect(folder);
  }
  void expect(const std::filesystem::path& folder) {
    auto disk = open_existing_directory(folder);
    ASSERT_TRUE(disk);
    const auto recovered = recover(*disk.value());
    expected_.push_back(recovered ? text_of(recovered.value().world)
                                  : "refused: " + recovered.error().message);
  }

  void compare() {
    std::string command = std::string("python3 -B ") + HIL_SOURCE_DIR + "/tests/support/verify_log.py";
    for (std::size_t k = 0; k < expected_.size(); ++k)
      command += " " + directory(k).string();
    std::string output = output_of(command);
    for (std::size_t k = 0; k < expected_.size(); ++k) {
      const std::string head = "== " + directory(k).string() + "\n";
      ASSERT_EQ(output.compare(0, head.size(), head), 0) << output.substr(0, 200);
      const std::size_t end = std::min(output.find("== /", head.size()), output.size());
      const std::string answer = output.substr(head.size(), end - head.size());
      if (expected_[k].starts_with("refused: ")) {
        ASSERT_TRUE(answer.starts_with("refused: ")) << k << ": expected " << expected_[k];
      } else {
        ASSERT_EQ(answer, expected_[k]) << k;
      }
      output.erase(0, end);
    }
    ASSERT_TRUE(output.empty());
  }

  hil::tests::TemporaryFolder folder_;
  std::vector<std::string> expected_;
};

TEST_F(VerifierTest, ReadsTheSameWorlds) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const SampleLog sample = make_sample({.seed = seed,
                                          .commits = static_cast<int>(5 + 3 * seed),
                                          .segment_bytes = seed % 3 == 0 ? 2048u : 16384u,
                                          .closed = seed % 2 == 0,
                                          .checkpoints = seed % 4 != 0});
    add(sample.contents);
    ASSERT_EQ(expected_.back(), sample.latest_as_text);
  }
  compare();
}

TEST_F(VerifierTest, FindsTheSameDamage) {
  std::mt19937_64 random(1);
  int refused = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    SampleLog sample =
        make_sample({.seed = seed, .commits = 15, .segment_bytes = 2048, .closed = seed % 2 == 0});
    auto file =
        std::next(sample.contents.begin(), static_cast<std::ptrdiff_t>(random() % sample.contents.size()));
    if (file->second.empty()) continue;
    switch (seed % 4) {
      case 0:
        file->second.resize(random() % file->second.size());
        break;
      case 1:
        sample.contents.erase(file);
        break;
      default:
        file->second[random() % file->second.size()] ^= static_cast<std::byte>(1u << random() % 8);
    }
    add(sample.contents);
    if (expected_.back().starts_with("refused")) ++refused;
  }
  EXPECT_GT(refused, 15);
  EXPECT_LT(refused, 50);
  compare();
}

TEST_F(VerifierTest, ReadsALogOnARealDisk) {
  History history;
  for (std::uint64_t round = 1; round <= 3; ++round) {
    auto opened = open_directory(directory(0));
    Disk& real = *opened.value();
    const Recovered recovered = recover(real).value();
    hil::tests::SimulatedClock clock;
    LiveWorld world(round, history, 1 << 14, recovered);
    auto writer = Writer::start(real, clock, world.ring(), world,
                                {.segment_bytes = 16384, .checkpoint_every_bytes = 10'000},
                                start_after(recovered, 4711));
    ASSERT_TRUE(writer.ok()) << writer.error().message;
    world.add_geometry(real, 4711, round);
    for (int k = 0; k < 30; ++k) {
      world.commit();
      writer.value()->step(1'700'000'000'000'000'000);
    }
    write_all(*writer.value());
    EXPECT_EQ(writer.value()->durable(), world.latest());
    ASSERT_TRUE(round != 2 || writer.value()->close(0).ok());
    const Recovered again = recover(real).value();
    EXPECT_TRUE(image_of(again.world) == history.images.at(world.latest()));
  }
  expect(directory(0));
  compare();
}

}  // namespace
}  // namespace rtstdb::log::test
