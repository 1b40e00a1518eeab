#include <nlohmann/json.hpp>

#include <cstdio>
#include <ctime>

#include <rtstdb/log.hpp>

#include "runtime/cli/db_export.hpp"
#include "runtime/cli/flush_output.hpp"
#include "runtime/cli/history_answers.hpp"
#include "runtime/cli/subcommands.hpp"
#include "runtime/cli/text_table.hpp"
#include "runtime/history/run_log.hpp"
#include "runtime/report/json_layout.hpp"
#include "runtime/report/quantities.hpp"
#include "runtime/report/text_safety.hpp"
#include "runtime/run/session.hpp"

namespace hil::cli {
namespace {

std::string seconds(rtstdb::WorldTime time) {
  return report::to_ascii(report::instant(time.time_since_epoch().count()));
}

std::string versions_text(const rtstdb::LogFile& file) {
  if (file.last == 0) return "-";
  if (file.first == file.last) return std::to_string(file.last);
  return std::to_string(file.first) + " to " + std::to_string(file.last);
}

std::string point_text(const rtstdb::VersionInfo& version) {
  return version.version == 0 ? "version 0, the empty world"
                              : "version " + std::to_string(version.version) + " of " + seconds(version.time);
}

std::string json_of(const std::string& directory, const rtstdb::LogContents& contents) {
  Json json;
  json["directory"] = report::valid_utf8(directory);
  json["database_id"] = report::id_text(contents.database_id);
  json["format"] = contents.format;
  json["whole"] = contents.damage.empty();
  json["damage"] = contents.damage;
  json["opens"] = contents.opens;
  json["opens_at_version"] = contents.opens ? Json(contents.opens_at) : Json(nullptr);
  json["refusal"] = contents.refusal;
  json["opens_by_salvage"] = contents.opens_by_salvage;
  json["closed"] = contents.extent.closed;
  json["torn"] = contents.torn;
  json["first"] = point_json(contents.extent.first);
  json["last"] = point_json(contents.extent.last);
  json["gaps"] = Json::array();
  for (const auto& gap : contents.extent.gaps)
    json["gaps"].push_back({{"first_version", gap.first}, {"last_version", gap.last}});
  json["commits"] = contents.extent.commits;
  json["unresolved_commits"] = contents.unresolved_commits;
  json["row_writes"] = contents.row_writes;
  json["shape_writes"] = contents.shape_writes;
  json["entities"] = contents.entities;
  json["groups"] = contents.groups;
  json["bytes"] = contents.bytes;
  json["compared_checkpoints"] = contents.compared_checkpoints;
  json["files"] = Json::array();
  for (const rtstdb::LogFile& file : contents.files) {
    json["files"].push_back({{"name", file.name},
                             {"kind", rtstdb::to_string(file.kind)},
                             {"bytes", file.bytes},
                             {"first_version", file.first},
                             {"last_version", file.last},
                             {"note", report::valid_utf8(file.note)},
                             {"damage", file.damage}});
  }
  return report::readable_json(json);
}

void print_facts(const std::string& directory, const rtstdb::LogContents& contents) {
  std::printf("%s: database %s, format %u\n", directory.c_str(),
              report::id_text(contents.database_id).c_str(), contents.format);
  std::printf("  from %s to %s: %s, %s\n", point_text(contents.extent.first).c_str(),
              point_text(contents.extent.last).c_str(),
              report::to_ascii(report::counted(contents.extent.commits, "commit", "commits")).c_str(),
              report::to_ascii(report::counted(contents.row_writes, "row written", "rows written")).c_str());
  std::printf("  %s in the last version; %s in %s\n",
              report::to_ascii(report::counted(contents.entities, "entity", "entities")).c_str(),
              report::bytes_text(contents.bytes).c_str(),
              report::to_ascii(report::counted(contents.groups, "group", "groups")).c_str());
  for (const auto& gap : contents.extent.gaps)
    std::printf("  versions %llu to %llu were not recorded: the disk was too slow\n",
                static_cast<unsigned long long>(gap.first), static_cast<unsigned long long>(gap.last));
  if (contents.unresolved_commits > 0)
    std::printf(
        "  %s behind the gap, up to the next checkpoint: unresolved, since the world before is not known\n",
        report::to_ascii(report::counted(contents.unresolved_commits, "commit", "commits")).c_str());
  if (contents.extent.closed) std::puts("  closed: complete to its end");
  if (const std::string open = history::not_closed(contents.extent); !open.empty())
    std::printf("  %s\n", open.c_str());
  if (!contents.torn.empty()) std::printf("  torn, cut off during a write: %s\n", contents.torn.c_str());
}

void print_files(const rtstdb::LogContents& contents) {
  TextTable table({{"File"}, {"Size", true}, {"Versions"}, {""}});
  for (const rtstdb::LogFile& file : contents.files)
    table.add({file.name, report::bytes_text(file.bytes), versions_text(file),
               file.damage.empty() ? file.note : "DAMAGED: " + file.damage});
  std::fputs(table.text().c_str(), stdout);
}

void print_damage(const rtstdb::LogContents& contents) {
  for (const std::string& damage : contents.damage)
    std::printf("  damaged: %s\n", damage.c_str());
  if (contents.damage.empty()) return;
  if (contents.opens)
    std::printf("  a database still opens with this log, at version %llu\n",
                static_cast<unsigned long long>(contents.opens_at));
  else
    std::printf("  a database %s: %s\n",
                contents.opens_by_salvage ? "opens with this log by salvage alone"
                                          : "does not open with this log, not even by salvage",
                contents.refusal.c_str());
}

enum class Detail { info, verify };

int inspect(const std::string& directory, Detail detail, bool json) {
  const history::RunLog run = history::find_run_log(directory);
  const std::string log = run.log.string();
  auto inspected = rtstdb::inspect_log(log);
  const char* const command = detail == Detail::info ? "db info" : "db verify";
  if (!inspected) {
    std::fprintf(stderr, "hil %s: %s\n", command, inspected.error().message.c_str());
    return run::exit_io_failed;
  }
  rtstdb::LogContents& contents = inspected.value();
  if (const std::string missing = history::missing_versions(run, contents.extent); !missing.empty())
    contents.damage.push_back(missing);
  if (json) {
    std::fputs(json_of(log, contents).c_str(), stdout);
  } else {
    print_facts(log, contents);
    if (detail == Detail::info) print_files(contents);
    print_damage(contents);
    if (contents.damage.empty())
      std::printf(
          "  not damaged: %s compared with the commits before, every checksum correct\n",
          report::to_ascii(report::counted(contents.compared_checkpoints, "checkpoint", "checkpoints"))
              .c_str());
  }
  return flush_output(command, contents.damage.empty() ? run::exit_passed : run::exit_io_failed);
}

}  // namespace

void add_db(CLI::App& app, int& exit_code) {
  struct Arguments {
    std::string directory;
    bool json = false;
    ExportOptions exported;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("db", "list, verify or export the log of a database");
  command->require_subcommand(1);
  const auto guarded = [&exit_code](const char* name, const std::function<int()>& work) {
    try {
      exit_code = work();
    } catch (const history::HistoryError& error) {
      std::fprintf(stderr, "hil %s: %s\n", name, error.what());
      exit_code = run::exit_io_failed;
    }
  };
  const auto add = [&](const char* name, const char* about, auto&& work) {
    CLI::App* one = command->add_subcommand(name, about);
    one->add_option("directory", arguments->directory, "the folder of a run, or a database's directory")
        ->required();
    one->callback([guarded, name, work] { guarded((std::string("db ") + name).c_str(), work); });
    return one;
  };
  add("info", "list files, versions, times and sizes", [arguments] {
    return inspect(arguments->directory, Detail::info, arguments->json);
  })->add_flag("--json", arguments->json, "print JSON");
  add("verify", "read and verify the whole log; exit with 4 when anything is damaged", [arguments] {
    return inspect(arguments->directory, Detail::verify, arguments->json);
  })->add_flag("--json", arguments->json, "print JSON");
  CLI::App* exported = add("export", "write every commit as JSON Lines",
                           [arguments] { return export_log(arguments->directory, arguments->exported); });
  exported->add_option("--out", arguments->exported.file, "write to this file instead of stdout");
  exported->add_flag("--no-meshes", arguments->exported.without_meshes,
                     "leave out positions and triangles of geometries");
  exported->add_flag("--salvage", arguments->exported.salvage, "read a damaged log up to the damage");
}

}  // namespace hil::cli
