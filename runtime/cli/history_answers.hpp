#pragma once
// Answers of a run's history as text for the console and as JSON. One call per instant of a query.

#include <nlohmann/json.hpp>

#include <string>

#include "runtime/cli/history_image.hpp"
#include "runtime/history/past.hpp"

namespace hil::cli {

using Json = nlohmann::ordered_json;

/// {version, time_ns}; time_ns is null for version 0, the empty world.
Json point_json(const rtstdb::VersionInfo& version);

/// Both forms of one answer.
struct Answer {  // NOLINT(bugprone-exception-escape): taken for one that moves JSON without noexcept
  std::string text;
  Json json;
};

Answer describe_extent(const history::RunHistory& history, const std::string& directory);
Answer describe_entities(const history::RunHistory& history, const history::Instant& instant,
                         const std::vector<history::Body>& bodies);
Answer describe_neighbors(const history::RunHistory& history, const history::Instant& instant,
                          rtstdb::EntityId entity, double radius_m, const history::Near& near);
Answer describe_region(const history::RunHistory& history, const history::Instant& instant,
                       const std::vector<rtstdb::EntityId>& entities);
Answer describe_hits(const history::RunHistory& history, const history::Instant& instant,
                     const rtstdb::Ray& ray, const std::vector<rtstdb::RayHit>& hits);
Answer describe_image(const history::RunHistory& history, const history::Instant& instant,
                      const std::string& camera, const modules::StillImage& image,
                      const ImageFileNames& files);
Answer describe_sweep(const history::RunHistory& history, const std::string& scanner,
                      const history::Sweep& sweep);

/// Every beam that hit, one line each: time_ns, column, row, range, point, entity, triangle.
std::string points_csv(const history::RunHistory& history, const history::Sweep& sweep);

}  // namespace hil::cli
