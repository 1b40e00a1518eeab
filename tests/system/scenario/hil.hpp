#pragma once
// The program `hil`, its scenarios, and the folder of a test.

#include <filesystem>
#include <initializer_list>
#include <string>
#include <vector>

#include "tests/system/scenario/program.hpp"

namespace hil::scenario_test {

/// A built program's path: hil, hil-crossing-plc.
std::string built(const std::string& program);
/// configs/crossing/crossing.yaml of this checkout.
std::string crossing();

/// The words of `hil WORDS...`.
std::vector<std::string> hil(std::vector<std::string> words);
/// Runs it to its end.
Ended run_hil(std::vector<std::string> words, const Environment& environment = {});
/// The same, and no file can become larger, as on a full disk.
Ended run_with_file_limit(int kib, const std::vector<std::string>& words);
/// Waits until the run that writes into the folder `out` has begun. False when it ends before.
bool run_begins(Program& run, const std::filesystem::path& out);

/// Fewer beams and no view, for runs whose scan is not checked.
std::vector<std::string> few_beams();
/// For runs in real time on machines that share their processors: a late tick is no hang, and skipped ticks
/// do not break the timing.
std::vector<std::string> relaxed_timing();

/// One command line of several parts.
std::vector<std::string> joined(std::initializer_list<std::vector<std::string>> parts);

std::string read_text(const std::filesystem::path& file);
void write_text(const std::filesystem::path& file, const std::string& text);

/// An empty folder, removed at the end unless the test has failed.
class Folder {
 public:
  Folder();
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const std::filesystem::path& path() const noexcept { return path_; }
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

/// A scenario s.yaml in a folder of its own; a test adds further files.
struct ScenarioFolder {
  explicit ScenarioFolder(const std::string& text) { write_text(folder / "s.yaml", text); }
  /// `hil run s.yaml --out OUT MORE...`
  Ended run(const std::string& out, const std::vector<std::string>& more = {}) const {
    return run_hil(joined({{"run", folder / "s.yaml", "--out", folder / out}, more}));
  }
  Folder folder;
};

/// A copy of the crossing's files, to be changed.
class ScenarioCopy {
 public:
  ScenarioCopy();
  std::string file() const { return folder_ / "crossing.yaml"; }
  const Folder& folder() const noexcept { return folder_; }
  /// Replaces the only occurrence of `from` in a file. Returns the place of `marked` in the result as hil
  /// reports it: FILE:LINE:COLUMN with the file's full path.
  std::string replace(const std::string& from, const std::string& to, const std::string& marked,
                      const std::string& name = "crossing.yaml");

 private:
  Folder folder_;
};

}  // namespace hil::scenario_test
