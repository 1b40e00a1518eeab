#include "runtime/cli/history_answers.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "runtime/cli/text_table.hpp"
#include "runtime/report/quantities.hpp"
#include "runtime/report/text_safety.hpp"

namespace hil::cli {
namespace {

using history::Instant;
using history::RunHistory;

std::string plain(double value, int decimals) {
  return report::to_ascii(report::decimal(value == 0.0 ? 0.0 : value, decimals));
}

std::string exact_seconds(std::int64_t ns) {
  return report::to_ascii(report::shortest(static_cast<double>(ns) / 1e9)) + " s";
}

std::string vector_text(const glm::dvec3& v) {
  return plain(v.x, 3) + " " + plain(v.y, 3) + " " + plain(v.z, 3);
}

Json vector_json(const glm::dvec3& v) {
  return {v.x, v.y, v.z};
}

std::string at(const Instant& instant) {
  std::string text = "at " + exact_seconds(instant.time_ns);
  if (instant.known_at_ns) text += ", as known at " + exact_seconds(*instant.known_at_ns);
  return text;
}

Json of(const Instant& instant) {
  Json json{{"time_ns", instant.time_ns}};
  if (instant.known_at_ns) json["known_at_ns"] = *instant.known_at_ns;
  return json;
}

Json entity_json(const RunHistory& history, rtstdb::EntityId entity) {
  return {{"name", report::valid_utf8(history.name_of(entity))},
          {"index", entity.index},
          {"generation", entity.generation}};
}

/// The heading of the body's x axis, counted from x to y.
double heading_deg(const glm::dquat& q) {
  const glm::dvec3 ahead = q * glm::dvec3(1.0, 0.0, 0.0);
  return std::atan2(ahead.y, ahead.x) * 180.0 / 3.14159265358979323846;
}

}  // namespace

Json point_json(const rtstdb::VersionInfo& version) {
  Json json{{"version", version.version}, {"time_ns", nullptr}};
  if (version.version > 0) json["time_ns"] = version.time.time_since_epoch().count();
  return json;
}

Answer describe_extent(const RunHistory& history, const std::string& directory) {
  const rtstdb::HistoryExtent& extent = history.extent();
  const contribution::WorldRecord& world = history.world();
  Answer answer;
  answer.json = {{"directory", report::valid_utf8(directory)},
                 {"scenario", report::valid_utf8(world.scenario)},
                 {"end_ns", history.end_ns() ? Json(*history.end_ns()) : Json(nullptr)},
                 {"first", point_json(extent.first)},
                 {"last", point_json(extent.last)},
                 {"commits", extent.commits},
                 {"closed", extent.closed},
                 {"not_closed", history.not_closed()},
                 {"damage", history.damage()},
                 {"shortfall", history.shortfall()},
                 {"gaps", Json::array()},
                 {"layers", world.layers},
                 {"entities", Json::array()},
                 {"scanners", Json::array()},
                 {"cameras", Json::array()}};
  std::string& text = answer.text;
  text =
      directory + (world.scenario.empty() ? std::string() : ": " + report::one_line(world.scenario)) + '\n';
  text += history.end_ns() ? "  the run was over after " + exact_seconds(*history.end_ns()) + '\n'
                           : std::string("  the run left no report: killed, or still running\n");
  text += "  " + report::to_ascii(report::counted(extent.commits, "version", "versions"));
  if (extent.last.version > 0)
    text += ", the last of " + exact_seconds(extent.last.time.time_since_epoch().count());
  text += '\n';
  if (extent.first.version > 0)
    text += "  the record begins at " + exact_seconds(extent.first.time.time_since_epoch().count()) + '\n';
  if (const std::string missing = history.shortfall(); !missing.empty()) text += "  " + missing + '\n';
  for (const auto& gap : extent.gaps) {
    answer.json["gaps"].push_back({{"first_version", gap.first}, {"last_version", gap.last}});
    text += "  versions " + std::to_string(gap.first) + " to " + std::to_string(gap.last) +
            " were not recorded: the disk was too slow\n";
  }
  if (!history.not_closed().empty()) text += "  " + history.not_closed() + '\n';
  if (const std::string damage = history.damage(); !damage.empty())
    text += "  damaged, and read without the damaged part: " + damage + '\n';
  std::string names;
  for (const contribution::NamedEntity& entity : world.entities) {
    answer.json["entities"].push_back(entity_json(history, {entity.index, entity.generation}));
    names += (names.empty() ? "" : ", ") + report::one_line(entity.name);
  }
  if (!names.empty()) text += "  entities: " + names + '\n';
  names.clear();
  for (const auto& scanner : history.scanners()) {
    answer.json["scanners"].push_back(scanner->description().name);
    names += (names.empty() ? "" : ", ") + report::one_line(scanner->description().name);
  }
  if (!names.empty()) text += "  scanners: " + names + '\n';
  names.clear();
  for (const modules::RecordedCamera& camera : history.cameras()) {
    answer.json["cameras"].push_back(report::valid_utf8(camera.name));
    names += (names.empty() ? "" : ", ") + report::one_line(camera.name);
  }
  if (!names.empty()) text += "  cameras: " + names + '\n';
  return answer;
}

Answer describe_entities(const RunHistory& history, const Instant& instant,
                         const std::vector<history::Body>& bodies) {
  Answer answer;
  answer.json = of(instant);
  answer.json["entities"] = Json::array();
  TextTable table({{"Entity"},
                   {"x", true},
                   {"y", true},
                   {"z m", true},
                   {"heading deg", true},
                   {"speed m/s", true},
                   {"Layers"},
                   {"Written by", true}});
  for (const history::Body& body : bodies) {
    const rtstdb::EntityRow& row = body.state.row;
    const glm::dquat& q = body.pose.q_world;
    Json one = entity_json(history, body.state.id);
    one["p_world_m"] = vector_json(body.pose.p_world_m);
    one["q_world_wxyz"] = {q.w, q.x, q.y, q.z};
    one["v_world_mps"] = vector_json(row.motion.v_world_mps);
    one["w_world_radps"] = vector_json(row.motion.w_world_radps);
    one["mask"] = row.mask;
    one["written_by"] = body.state.written_by;
    answer.json["entities"].push_back(std::move(one));
    table.add({history.name_of(body.state.id), plain(body.pose.p_world_m.x, 3),
               plain(body.pose.p_world_m.y, 3), plain(body.pose.p_world_m.z, 3), plain(heading_deg(q), 1),
               plain(glm::length(row.motion.v_world_mps), 2), history.layers_of(row.mask),
               "version " + std::to_string(body.state.written_by)});
  }
  answer.text =
      at(instant) + ": " + report::to_ascii(report::counted(bodies.size(), "entity", "entities")) + '\n';
  if (!table.empty()) answer.text += table.text();
  return answer;
}

Answer describe_neighbors(const RunHistory& history, const Instant& instant, rtstdb::EntityId entity,
                          double radius_m, const history::Near& near) {
  Answer answer;
  answer.json = of(instant);
  answer.json["of"] = entity_json(history, entity);
  answer.json["from_world_m"] = vector_json(near.from_world_m);
  answer.json["within_m"] = radius_m;
  answer.json["found"] = near.found;
  answer.json["incomplete"] = near.incomplete;
  answer.json["neighbors"] = Json::array();
  TextTable table(
      {{"Entity"}, {"distance m", true}, {"nearest point (x y z)", true}, {"closing m/s", true}, {"Layers"}});
  for (const rtstdb::Neighbor& neighbor : near.neighbors) {
    const glm::dvec3 point(neighbor.p_world_m);
    const glm::dvec3 away = point - near.from_world_m;
    const double distance = glm::length(away);
    const double closing =
        distance > 0.0 ? -glm::dot(glm::dvec3(neighbor.v_relative_mps), away) / distance : 0.0;
    Json one = entity_json(history, neighbor.entity);
    one["distance_m"] = neighbor.distance_m;
    one["p_world_m"] = vector_json(point);
    one["v_relative_mps"] = vector_json(glm::dvec3(neighbor.v_relative_mps));
    one["triangle"] = neighbor.triangle;
    answer.json["neighbors"].push_back(std::move(one));
    table.add({history.name_of(neighbor.entity), plain(static_cast<double>(neighbor.distance_m), 3),
               vector_text(point), plain(closing, 2), history.layers_of(neighbor.mask)});
  }
  answer.text = at(instant) + ": " + report::to_ascii(report::counted(near.found, "entity", "entities")) +
                " within " + report::to_ascii(report::shortest(radius_m)) + " m of " +
                report::one_line(history.name_of(entity)) + ", measured from " +
                vector_text(near.from_world_m) + '\n';
  if (near.found > near.neighbors.size())
    answer.text += "the nearest " + std::to_string(near.neighbors.size()) + " of them:\n";
  if (near.incomplete) answer.text += "incomplete: the device's limits cut the search short\n";
  if (!table.empty()) answer.text += table.text();
  return answer;
}

Answer describe_region(const RunHistory& history, const Instant& instant,
                       const std::vector<rtstdb::EntityId>& entities) {
  Answer answer;
  answer.json = of(instant);
  answer.json["entities"] = Json::array();
  answer.text =
      at(instant) + ": " + report::to_ascii(report::counted(entities.size(), "entity", "entities")) + '\n';
  for (const rtstdb::EntityId entity : entities) {
    answer.json["entities"].push_back(entity_json(history, entity));
    answer.text += report::one_line(history.name_of(entity)) + '\n';
  }
  return answer;
}

Answer describe_hits(const RunHistory& history, const Instant& instant, const rtstdb::Ray& ray,
                     const std::vector<rtstdb::RayHit>& hits) {
  Answer answer;
  answer.json = of(instant);
  answer.json["hits"] = Json::array();
  const double length = glm::length(glm::dvec3(ray.direction));
  TextTable table({{"Entity"},
                   {"distance m", true},
                   {"triangle", true},
                   {"normal (x y z)", true},
                   {"relative velocity m/s", true},
                   {"Layers"}});
  for (const rtstdb::RayHit& hit : hits) {
    const double distance_m = static_cast<double>(hit.lambda) * length;
    Json one = entity_json(history, hit.entity);
    one["distance_m"] = distance_m;
    one["triangle"] = hit.triangle;
    one["u"] = hit.u;
    one["v"] = hit.v;
    one["n_world"] = vector_json(glm::dvec3(hit.n_world));
    one["v_relative_mps"] = vector_json(glm::dvec3(hit.v_relative_mps));
    answer.json["hits"].push_back(std::move(one));
    table.add({history.name_of(hit.entity), plain(distance_m, 3), std::to_string(hit.triangle),
               vector_text(glm::dvec3(hit.n_world)), vector_text(glm::dvec3(hit.v_relative_mps)),
               history.layers_of(hit.mask)});
  }
  answer.text = at(instant) + ": " +
                (hits.empty() ? "no hit" : report::to_ascii(report::counted(hits.size(), "hit", "hits"))) +
                '\n';
  if (!table.empty()) answer.text += table.text();
  return answer;
}

Answer describe_image(const RunHistory& history, const Instant& instant, const std::string& camera,
                      const modules::StillImage& image, const ImageFileNames& files) {
  Answer answer;
  answer.json = of(instant);
  answer.json["camera"] = report::valid_utf8(camera);
  answer.json["file"] = report::valid_utf8(files.color);
  if (!files.depth.empty()) answer.json["depth_file"] = report::valid_utf8(files.depth);
  answer.json["width"] = image.width;
  answer.json["height"] = image.height;
  answer.json["exposure_value"] = image.exposure_value;
  answer.json["in_daylight"] = image.is_in_daylight;
  answer.json["is_dark"] = image.is_dark;
  answer.json["incomplete_pixels"] = image.incomplete_pixels;
  answer.json["lights_overflow"] = image.lights_overflow;
  answer.json["bodies"] = Json::array();
  TextTable table({{"Entity"}, {"depth m", true}, {"pixels", true}, {"columns", true}, {"rows", true}});
  for (const modules::VisibleBody& body : image.bodies) {
    Json one = entity_json(history, body.entity);
    one["depth_m"] = body.depth_m;
    one["pixels"] = body.pixels;
    one["box"] = {body.x_min, body.y_min, body.x_max, body.y_max};
    answer.json["bodies"].push_back(std::move(one));
    table.add({history.name_of(body.entity), plain(static_cast<double>(body.depth_m), 3),
               std::to_string(body.pixels), std::to_string(body.x_min) + "-" + std::to_string(body.x_max),
               std::to_string(body.y_min) + "-" + std::to_string(body.y_max)});
  }
  answer.text = at(instant) + ": " + report::one_line(files.color) + ", " + std::to_string(image.width) +
                " x " + std::to_string(image.height) + " pixels, exposure value " +
                plain(image.exposure_value, 1) +
                (image.is_in_daylight ? ", in daylight, since it sees no light of the world\n" : "\n");
  if (image.is_dark) answer.text += "  no light is in the camera's layers, so the image is black\n";
  if (image.incomplete_pixels > 0)
    answer.text += "  " + std::to_string(image.incomplete_pixels) +
                   " pixels lack light or show nothing: a search reached a limit of the device\n";
  if (image.lights_overflow)
    answer.text += "  light is missing: the world has more lights than an image may have\n";
  if (image.ignored_pixels > 0)
    answer.text += "  the list leaves out the bodies of " + std::to_string(image.ignored_pixels) +
                   " pixels: the image shows too many\n";
  answer.text += table.empty() ? "  no body is visible\n" : table.text();
  return answer;
}

Answer describe_sweep(const RunHistory& history, const std::string& scanner, const history::Sweep& sweep) {
  struct Seen {
    std::uint64_t beams = 0;  ///< with a return of it
    double nearest_m = 0.0, farthest_m = 0.0;
    double brightest_per_m2 = 0.0;
    std::int64_t first_ns = 0, last_ns = 0;
  };
  std::map<rtstdb::EntityId, Seen> seen;
  std::uint64_t hits = 0, returns = 0, incomplete = 0;
  for (const history::Beam& beam : sweep.beams) {
    incomplete += beam.incomplete ? 1 : 0;
    hits += beam.returns.empty() ? 0 : 1;
    for (const history::Return& of_beam : beam.returns) {
      ++returns;
      const auto [range_m, intensity] = of_beam.detection;
      Seen& one = seen[of_beam.beam_return.hit.entity];
      if (one.beams++ == 0) one = {1, range_m, range_m, intensity, beam.time_ns, beam.time_ns};
      one.nearest_m = std::min(one.nearest_m, range_m);
      one.farthest_m = std::max(one.farthest_m, range_m);
      one.brightest_per_m2 = std::max(one.brightest_per_m2, intensity);
      one.last_ns = beam.time_ns;
    }
  }
  Answer answer;
  answer.json = {{"scanner", report::valid_utf8(scanner)},
                 {"begin_ns", sweep.begin_ns},
                 {"end_ns", sweep.end_ns},
                 {"whole", sweep.whole},
                 {"beams", sweep.beams.size()},
                 {"hits", hits},
                 {"returns", returns},
                 {"incomplete", incomplete},
                 {"entities", Json::array()}};
  TextTable table({{"Entity"},
                   {"beams", true},
                   {"nearest m", true},
                   {"farthest m", true},
                   {"brightest 1/m^2", true},
                   {"first s", true},
                   {"last s", true}});
  for (const auto& [entity, one] : seen) {
    Json json = entity_json(history, entity);
    json["beams"] = one.beams;
    json["nearest_m"] = one.nearest_m;
    json["farthest_m"] = one.farthest_m;
    json["brightest_per_m2"] = one.brightest_per_m2;
    json["first_ns"] = one.first_ns;
    json["last_ns"] = one.last_ns;
    answer.json["entities"].push_back(std::move(json));
    table.add({history.name_of(entity), std::to_string(one.beams), plain(one.nearest_m, 3),
               plain(one.farthest_m, 3), report::to_ascii(report::shortest(one.brightest_per_m2)),
               plain(static_cast<double>(one.first_ns) * 1e-9, 4),
               plain(static_cast<double>(one.last_ns) * 1e-9, 4)});
  }
  answer.text = report::one_line(scanner) + ", sweep from " + exact_seconds(sweep.begin_ns) + " to " +
                exact_seconds(sweep.end_ns) + ": " + report::to_ascii(report::count_text(hits)) + " of " +
                report::to_ascii(report::counted(sweep.beams.size(), "beam", "beams")) + " hit" +
                (sweep.whole ? "\n" : "; the run ended during the sweep\n");
  if (incomplete > 0)
    answer.text +=
        std::to_string(incomplete) + " beams are incomplete: the device's limits cut their search short\n";
  if (!table.empty()) answer.text += table.text();
  return answer;
}

std::string points_csv(const RunHistory& history, const history::Sweep& sweep) {
  std::string text =
      "time_ns,column,row,range_m,x_m,y_m,z_m,entity,index,generation,triangle,return,fraction,"
      "intensity_per_m2\n";
  for (const history::Beam& beam : sweep.beams) {
    for (const history::Return& one : beam.returns) {
      const glm::dvec3& p = one.p_world_m;
      const rtstdb::RayHit& hit = one.beam_return.hit;
      text += std::to_string(beam.time_ns) + ',' + std::to_string(beam.column) + ',' +
              std::to_string(beam.row) + ',' + report::shortest(one.detection.range_m) + ',' +
              report::shortest(p.x) + ',' + report::shortest(p.y) + ',' + report::shortest(p.z) + ',' +
              history.name_of(hit.entity) + ',' + std::to_string(hit.entity.index) + ',' +
              std::to_string(hit.entity.generation) + ',' + std::to_string(hit.triangle) + ',' +
              std::to_string(one.ordinal) + ',' +
              report::shortest(static_cast<double>(one.beam_return.fraction)) + ',' +
              report::shortest(one.detection.intensity_per_m2) + '\n';
    }
  }
  return report::to_ascii(text);
}

}  // namespace hil::cli
