// A world with one moving box, and one ray that asks where the box is half a second later.
#include <cmath>
#include <cstdio>

#include <rtstdb/database.hpp>

int main() {
  auto opened = rtstdb::Database::open({});
  if (!opened) {
    std::fprintf(stderr, "%s\n", opened.error().message.c_str());
    return 1;
  }
  rtstdb::Database& database = *opened.value();
  const auto box = database.add_geometry(rtstdb::make_box({2.0, 2.0, 2.0}), "box");
  const auto query = database.prepare(rtstdb::RayQueryOptions{.name = "beam", .capacity = 1});
  const auto transaction = database.make_transaction({.max_writes = 1, .max_queries = 1});
  if (!box || !query) return 1;

  rtstdb::EntityRow row;
  row.geometry = box.value();
  row.motion.v_world_mps = {10.0, 0.0, 0.0};
  rtstdb::Ray& ray = query.value()->rays()[0];
  ray.origin_m = {-6.0f, 0.0f, 0.0f};
  ray.direction = {1.0f, 0.0f, 0.0f};
  ray.t = rtstdb::world_time_ns(500'000'000);

  transaction->begin({});
  const auto box_entity = transaction->create(row);
  transaction->add_query(*query.value(), 1);
  const rtstdb::Outcome& outcome = database.execute(*transaction);
  if (!outcome.done()) {
    std::fprintf(stderr, "%s\n", describe(outcome).c_str());
    return 1;
  }
  const rtstdb::RayHit& hit = query.value()->hits()[0];
  std::printf("hit at %.3f m, going away at %.1f m/s\n", hit.lambda, hit.v_relative_mps.x);
  // The box has moved 5 m: its near side stands at x = 4 m, and it goes away from the ray's origin.
  const bool right = hit.entity == transaction->created(box_entity) && std::abs(hit.lambda - 10.0f) < 1e-4f &&
                     std::abs(hit.v_relative_mps.x - 10.0f) < 1e-3f;
  return right ? 0 : 1;
}
