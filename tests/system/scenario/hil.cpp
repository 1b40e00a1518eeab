#include "tests/system/scenario/hil.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "tests/paths.h"

namespace hil::scenario_test {

std::string built(const std::string& program) {
  return std::string(HIL_BINARY_DIR) + "/bin/" + program;
}

std::string crossing() {
  return std::string(HIL_SOURCE_DIR) + "/configs/crossing/crossing.yaml";
}

std::vector<std::string> hil(std::vector<std::string> words) {
  words.insert(words.begin(), built("hil"));
  return words;
}

Ended run_hil(std::vector<std::string> words, const Environment& environment) {
  return Program(hil(std::move(words)), environment).wait();
}

Ended run_with_file_limit(int kib, const std::vector<std::string>& words) {
  const std::string command = "ulimit -f " + std::to_string(kib) + "; exec \"$@\"";
  return Program(joined({{"bash", "-c", command, "bash"}, hil(words)})).wait();
}

bool run_begins(Program& run, const std::filesystem::path& out) {
  const auto has_begun = [&] {
    return std::filesystem::exists(out / "run.log") &&
           read_text(out / "run.log").find("the run begins") != std::string::npos;
  };
  return eventually([&] { return has_begun() || !run.running(); }) && has_begun();
}

std::vector<std::string> few_beams() {
  return {"--set", "tasks.scanner.parameters.columns=96",
          "--set", "tasks.scanner.parameters.rows=24",
          "--set", "world.views=[]"};
}

std::vector<std::string> relaxed_timing() {
  return {"--set", "realtime.watchdog=30 s", "--set", "realtime.max_lost=100 %"};
}

std::vector<std::string> joined(std::initializer_list<std::vector<std::string>> parts) {
  std::vector<std::string> words;
  for (const std::vector<std::string>& part : parts)
    words.insert(words.end(), part.begin(), part.end());
  return words;
}

std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  EXPECT_TRUE(stream) << file;
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  EXPECT_TRUE(stream) << file;
}

Folder::Folder() {
  std::string name = ::testing::TempDir() + "/hil-scenario-XXXXXX";
  EXPECT_NE(mkdtemp(name.data()), nullptr) << name;
  path_ = std::filesystem::canonical(name);
}

Folder::~Folder() {
  if (!::testing::Test::HasFailure()) std::filesystem::remove_all(path_);
}

ScenarioCopy::ScenarioCopy() {
  for (const char* name : {"crossing.yaml", "crossing.dbc", "crossing_plc.yaml"}) {
    std::filesystem::copy_file(std::string(HIL_SOURCE_DIR) + "/configs/crossing/" + name, folder_ / name);
  }
}

std::string ScenarioCopy::replace(const std::string& from, const std::string& to, const std::string& marked,
                                  const std::string& name) {
  std::string text = read_text(folder_ / name);
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << "'" << from << "' is not in " << name;
  if (at == std::string::npos) return {};
  EXPECT_EQ(text.find(from, at + 1), std::string::npos) << "'" << from << "' is more than once in " << name;
  text.replace(at, from.size(), to);
  write_text(folder_ / name, text);
  const std::size_t mark = text.find(marked, at);
  EXPECT_LT(mark, at + to.size()) << "'" << marked << "' is not in '" << to << "'";
  const std::size_t line_begin = text.rfind('\n', mark) + 1;
  const auto before = text.begin() + static_cast<std::ptrdiff_t>(mark);
  return folder_ / name + ":" + std::to_string(1 + std::count(text.begin(), before, '\n')) + ":" +
         std::to_string(mark - line_begin + 1);
}

}  // namespace hil::scenario_test
