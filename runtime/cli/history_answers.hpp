#pragma once
// Answers of a run's history as a user reads them and as JSON. One call per instant that is asked about.

#include <nlohmann/json.hpp>

#include <string>

#include "runtime/history/past.hpp"

namespace hil::cli {

using Json = nlohmann::ordered_json;

/// The empty world holds from no time.
Json point_json(const rtstdb::VersionInfo& version);

/// Both forms of one answer.
struct Told {  // NOLINT(bugprone-exception-escape): taken for one that moves JSON without noexcept
  std::string text;
  Json json;
};

Told tell_extent(const history::RunHistory& history, const std::string& directory);
Told tell_bodies(const history::RunHistory& history, const history::Instant& instant,
                 const std::vector<history::Body>& bodies);
Told tell_near(const history::RunHistory& history, const history::Instant& instant, rtstdb::EntityId entity,
               double radius_m, const history::Near& near);
Told tell_region(const history::RunHistory& history, const history::Instant& instant,
                 const std::vector<rtstdb::EntityId>& entities);
Told tell_ray(const history::RunHistory& history, const history::Instant& instant, const rtstdb::Ray& ray,
              const std::vector<rtstdb::RayHit>& hits);
Told tell_sweep(const history::RunHistory& history, const std::string& scanner, const history::Sweep& sweep);

/// Every beam that hit, one line each: time_ns, column, row, range, point, entity, triangle.
std::string points_csv(const history::RunHistory& history, const history::Sweep& sweep);

}  // namespace hil::cli
