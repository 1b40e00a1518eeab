#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <functional>

#include <rtstdb/limits.hpp>

#include "runtime/cli/flush_output.hpp"
#include "runtime/cli/history_answers.hpp"
#include "runtime/cli/history_image.hpp"
#include "runtime/cli/history_options.hpp"
#include "runtime/cli/limited_memory.hpp"
#include "runtime/cli/start_failure.hpp"
#include "runtime/cli/subcommands.hpp"
#include "runtime/report/json_layout.hpp"
#include "runtime/report/quantities.hpp"
#include "runtime/run/session.hpp"

namespace hil::cli {
namespace {

using history::HistoryError;
using history::Instant;
using history::Past;
using history::RunHistory;

struct Arguments {
  std::string directory;
  bool json = false, salvage = false;
  std::string gpu = "auto";
  std::string at, until, every, known_at;

  std::string entity, within = "5m", scanner, points, carrier, range, level = "bounds";
  std::vector<std::string> layers;
  std::vector<double> from, sphere, box, origin, direction;
  bool inside = false;
  std::uint32_t hits = 1;
  ImageArguments image;
};

/// A longer series is refused: a long range with a small step is more likely a mistake than intended.
constexpr std::int64_t max_instants = 1'000'000;

/// The run times of the query: --at, and with --until and --every the series up to --until.
std::vector<Instant> instants(const Arguments& arguments, const RunHistory& history) {
  Instant instant{.time_ns = read_time_ns("--at", arguments.at)};
  history.check_time(instant.time_ns);
  if (!arguments.known_at.empty()) {
    instant.known_at_ns = read_time_ns("--known-at", arguments.known_at);
    history.check_time(*instant.known_at_ns);
    if (*instant.known_at_ns > instant.time_ns)
      refuse("--known-at " + arguments.known_at + " is after --at " + arguments.at);
  }
  if (arguments.until.empty() != arguments.every.empty())
    refuse("--until and --every need each other: give both or none");
  std::vector<Instant> all{instant};
  if (arguments.until.empty()) return all;
  const std::int64_t until_ns = read_time_ns("--until", arguments.until);
  history.check_time(until_ns);
  const std::int64_t every_ns = read_time_ns("--every", arguments.every);
  if (every_ns <= 0) refuse("--every " + arguments.every + " is not above zero");
  if (until_ns < instant.time_ns) refuse("--until " + arguments.until + " is before --at " + arguments.at);
  if ((until_ns - instant.time_ns) / every_ns >= max_instants)
    refuse("a query has at most " + std::to_string(max_instants) +
           " run times: choose a larger --every or an earlier --until");
  while (until_ns - instant.time_ns >= every_ns) {
    instant.time_ns += every_ns;
    all.push_back(instant);
  }
  return all;
}

/// Prints the answers one by one, so that a long series is never held in memory. As JSON: one document with
/// one answer per line.
class Answers {
 public:
  Answers(const Arguments& arguments, const char* query, const rtstdb::DeviceInfo& device,
          const RunHistory& history, std::int64_t last_ns)
      : as_json_(arguments.json) {
    const std::string doubt = history.doubt_about(last_ns);
    const std::string damage = history.damage();
    for (const std::string* sentence : {&history.not_closed(), &doubt, &damage})
      if (!sentence->empty()) std::fprintf(stderr, "hil history: %s\n", sentence->c_str());
    if (!as_json_) return;
    Json head{{"query", query},
              {"device", device.name},
              {"not_closed", history.not_closed()},
              {"doubt", doubt},
              {"damage", damage}};
    std::string text = head.dump();
    text.back() = ',';
    std::printf("%s\"answers\":[", text.c_str());
  }

  void add(const Answer& answer) {
    if (as_json_) {
      std::printf("%s\n%s", first_ ? "" : ",", answer.json.dump().c_str());
    } else {
      std::fputs(answer.text.c_str(), stdout);
    }
    first_ = false;
  }
  int end() {
    if (as_json_) std::fputs("\n]}\n", stdout);
    return flush_output("history", run::exit_passed);
  }

 private:
  bool as_json_;
  bool first_ = true;
};

/// Runs the query at each instant and prints the answers.
int each(const Arguments& arguments, const char* query,
         const std::function<Answer(const RunHistory&, Past&, const Instant&)>& answer_at) {
  const RunHistory history(arguments.directory, arguments.salvage);
  const std::vector<Instant> all = instants(arguments, history);
  // With --known-at, no version after that time is read.
  Past past(history, all.front().known_ns(), all.back().known_ns(), arguments.gpu);
  // The first query may be refused. Nothing is printed before it has succeeded.
  const Answer first = answer_at(history, past, all.front());
  Answers answers(arguments, query, past.device(), history, all.back().time_ns);
  answers.add(first);
  for (std::size_t k = 1; k < all.size(); ++k)
    answers.add(answer_at(history, past, all[k]));
  return answers.end();
}

int info(const Arguments& arguments) {
  const RunHistory history(arguments.directory, arguments.salvage);
  const Answer answer = describe_extent(history, arguments.directory);
  std::fputs(arguments.json ? report::readable_json(answer.json).c_str() : answer.text.c_str(), stdout);
  return flush_output("history", run::exit_passed);
}

int entities(const Arguments& arguments) {
  return each(arguments, "entities", [](const RunHistory& history, Past& past, const Instant& instant) {
    return describe_entities(history, instant, past.bodies(instant));
  });
}

int near(const Arguments& arguments) {
  const double radius_m = read_distance_m("--within", arguments.within);
  check_numbers("--from", arguments.from);
  std::optional<glm::dvec3> from_m;
  if (!arguments.from.empty()) from_m = glm::dvec3(arguments.from[0], arguments.from[1], arguments.from[2]);
  return each(arguments, "near", [&](const RunHistory& history, Past& past, const Instant& instant) {
    const rtstdb::EntityId entity = history.find(arguments.entity);
    return describe_neighbors(
        history, instant, entity, radius_m,
        past.near(instant, entity, from_m, radius_m, history.mask_of(arguments.layers)));
  });
}

rtstdb::EntityId carrier_of(const Arguments& arguments, const RunHistory& history) {
  return arguments.carrier.empty() ? rtstdb::EntityId{} : history.find(arguments.carrier);
}

int region(const Arguments& arguments) {
  if (arguments.sphere.empty() == arguments.box.empty()) refuse("give one of --sphere and --box");
  check_numbers("--sphere", arguments.sphere);
  check_numbers("--box", arguments.box);
  check_sizes("--sphere", arguments.sphere, 3);
  check_sizes("--box", arguments.box, 3);
  rtstdb::Region region;
  if (!arguments.sphere.empty()) {
    region.shape = rtstdb::RegionShape::sphere;
    region.center_m = three_of(arguments.sphere);
    region.half_extent_m = glm::vec3(static_cast<float>(arguments.sphere[3]));
  } else {
    region.center_m = three_of(arguments.box);
    region.half_extent_m = three_of(arguments.box, 3) * 0.5f;
  }
  region.test = arguments.inside ? rtstdb::RegionTest::inside : rtstdb::RegionTest::touching;
  const auto level =
      arguments.level == "surface" ? rtstdb::RegionLevel::surface : rtstdb::RegionLevel::bounds;
  return each(arguments, "region", [&](const RunHistory& history, Past& past, const Instant& instant) {
    region.mask = history.mask_of(arguments.layers);
    region.carrier = carrier_of(arguments, history);
    return describe_region(history, instant, past.in_region(instant, region, level));
  });
}

int ray(const Arguments& arguments) {
  rtstdb::Ray ray;
  check_numbers("--origin", arguments.origin);
  check_numbers("--direction", arguments.direction);
  ray.origin_m = three_of(arguments.origin);
  const glm::dvec3 direction(arguments.direction[0], arguments.direction[1], arguments.direction[2]);
  const double largest = std::max({std::abs(direction.x), std::abs(direction.y), std::abs(direction.z)});
  if (largest == 0.0) refuse("--direction is the zero vector");
  ray.direction = glm::vec3(glm::normalize(direction / largest));
  if (!arguments.range.empty())
    ray.lambda_max = static_cast<float>(read_distance_m("--range", arguments.range));
  return each(arguments, "ray", [&](const RunHistory& history, Past& past, const Instant& instant) {
    ray.mask = history.mask_of(arguments.layers);
    ray.carrier = carrier_of(arguments, history);
    return describe_hits(history, instant, ray, past.along(instant, ray, arguments.hits));
  });
}

void write_points(const std::string& file, const std::string& text) {
  errno = 0;
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  out << text;
  out.close();
  if (!out)
    throw HistoryError(HistoryError::Kind::file, file + " can not be written: " +
                                                     (errno != 0 ? std::strerror(errno) : "no reason given"));
}

int scan(const Arguments& arguments) {
  if (!arguments.points.empty()) check_outside("--points", arguments.points, arguments.directory);
  const RunHistory history(arguments.directory, arguments.salvage);
  const modules::RecordedScanner& scanner = history.scanner(arguments.scanner);
  const std::int64_t at_ns = read_time_ns("--at", arguments.at);
  history.check_time(at_ns);
  if (at_ns < scanner.description().first_sweep_ns)
    refuse("the scanner's first sweep begins at " +
           report::to_ascii(report::instant(scanner.description().first_sweep_ns)));
  const auto [begin_ns, end_ns] = Past::sweep_at(scanner, at_ns);
  if (begin_ns == history.end_ns()) refuse("the run ended before that sweep began");
  Past past(history, begin_ns, std::min(end_ns, history.end_ns().value_or(end_ns)), arguments.gpu);
  const history::Sweep sweep = past.scan(scanner, at_ns);
  if (!arguments.points.empty()) write_points(arguments.points, points_csv(history, sweep));
  Answers answers(arguments, "scan", past.device(), history, end_ns);
  answers.add(describe_sweep(history, arguments.scanner, sweep));
  return answers.end();
}

int image(const Arguments& arguments) {
  check_image_files(arguments.image, arguments.directory);
  std::size_t index = 0;
  return each(arguments, "image", [&](const RunHistory& history, Past& past, const Instant& instant) {
    const modules::RecordedCamera camera =
        camera_of(arguments.image, arguments.carrier, arguments.layers, history);
    const modules::StillImage still = past.image(camera, instant);
    const ImageFileNames files = image_file_names(arguments.image, index++, !arguments.until.empty());
    write_image(still, arguments.image, files);
    return describe_image(history, instant, camera.name, still, files);
  });
}

int exit_code_of(HistoryError::Kind kind) {
  switch (kind) {
    case HistoryError::Kind::question:
      return run::exit_bad_config;
    case HistoryError::Kind::file:
      return run::exit_io_failed;
    case HistoryError::Kind::gpu:
      return run::exit_gpu_failed;
  }
  return run::exit_internal;
}

int run_query(const Arguments& arguments, int (*answer)(const Arguments&)) {
  try {
    return answer(arguments);
  } catch (const HistoryError& error) {
    std::fprintf(stderr, "hil history: %s\n", error.what());
    return exit_code_of(error.kind());
  }
}

void add_time_options(CLI::App* command, Arguments& arguments, bool series) {
  command->add_option("--at", arguments.at, "run time of the query: 12.3s")->required();
  command->add_option("--gpu", arguments.gpu,
                      "the Vulkan device: a part of its name, its index in hil doctor, or auto");
  if (!series) return;
  command->add_option("--until", arguments.until, "with --every: the last run time");
  command->add_option("--every", arguments.every, "the step from one run time to the next: 100ms");
  command->add_option("--known-at", arguments.known_at,
                      "use what was known at that earlier time, extrapolated from there");
}

void add_frame_options(CLI::App* command, Arguments& arguments) {
  command
      ->add_option("--layers", arguments.layers,
                   "only entities, and for images lights, in one of these layers: car,static")
      ->delimiter(',');
  command->add_option("--carried-by", arguments.carrier,
                      "positions are in that entity's frame and move with it");
}

CLI::Option* add_numbers(CLI::App* command, const char* name, std::vector<double>& numbers, int count,
                         const char* about) {
  return command->add_option(name, numbers, about)->delimiter(',')->expected(count);
}

void add_queries(CLI::App* command, const std::shared_ptr<Arguments>& arguments,
                 const std::function<void(CLI::App*, int (*)(const Arguments&))>& bind) {
  Arguments& a = *arguments;
  CLI::App* one = command->add_subcommand("info", "times, names of entities and scanners, what is missing");
  bind(one, info);

  one = command->add_subcommand("entities", "every entity");
  add_time_options(one, a, true);
  bind(one, entities);

  one = command->add_subcommand("near", "the entities within a distance of an entity, the nearest first");
  one->add_option("entity", a.entity, "the entity's name, or INDEX.GENERATION")->required();
  one->add_option("--within", a.within,
                  "largest distance, from its centre to the others' surfaces (default: 5m)");
  add_numbers(one, "--from", a.from, 3, "measure from this point in its frame: x,y,z in m");
  one->add_option("--layers", a.layers, "only entities in one of these layers: car,static")->delimiter(',');
  add_time_options(one, a, true);
  bind(one, near);

  one = command->add_subcommand("region", "the entities in a region");
  add_numbers(one, "--sphere", a.sphere, 4, "x,y,z,radius in m");
  add_numbers(one, "--box", a.box, 6, "x,y,z of the centre and the full sizes along x,y,z, in m");
  one->add_flag("--inside", a.inside, "only entities that are completely inside");
  one->add_option("--level", a.level, "test an entity's box (bounds) or its triangles (surface)")
      ->check(CLI::IsMember({"bounds", "surface"}));
  add_frame_options(one, a);
  add_time_options(one, a, true);
  bind(one, region);

  one = command->add_subcommand("ray", "the first hits of a ray");
  add_numbers(one, "--origin", a.origin, 3, "start of the ray: x,y,z in m")->required();
  add_numbers(one, "--direction", a.direction, 3, "direction x,y,z, of any length")->required();
  one->add_option("--range", a.range, "range of the ray: 50m (default: no limit)");
  one->add_option("--hits", a.hits, "largest number of hits (default: 1)")->check(CLI::Range(1, 16));
  add_frame_options(one, a);
  add_time_options(one, a, true);
  bind(one, ray);

  one = command->add_subcommand("image", "what a camera sees, as a PNG file");
  add_image_options(one, a.image);
  add_frame_options(one, a);
  add_time_options(one, a, true);
  bind(one, image);

  one = command->add_subcommand("scan", "the sweep of a scanner at a time, beam by beam");
  one->add_option("scanner", a.scanner, "the name of the scanner's module")->required();
  one->add_option("--points", a.points, "write every hit to this file, as CSV");
  add_time_options(one, a, false);
  bind(one, scan);
}

}  // namespace

void add_history(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("history", "query the recorded world of a run, as of a time in it");
  command->add_option("directory", arguments->directory, "the folder of a run")->required();
  command->add_flag("--json", arguments->json, "print JSON");
  command->add_flag("--salvage", arguments->salvage, "read a damaged log up to the damage");
  command->require_subcommand(1);
  add_queries(command, arguments, [&](CLI::App* one, int (*answer)(const Arguments&)) {
    one->fallthrough();
    one->callback([arguments, answer, &exit_code] {
      exit_code =
          run_within_limits([&] { return run_query(*arguments, answer); },
                            [](const std::string& end) { return report_lack_of_memory("history", end); });
    });
  });
}

}  // namespace hil::cli
