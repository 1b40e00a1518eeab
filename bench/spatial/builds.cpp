#include "bench/spatial/builds.hpp"

#include <glm/gtc/quaternion.hpp>

#include <cmath>
#include <stdexcept>

#include "bench/spatial/embree_builds.hpp"
#include "bench/spatial/embree_hit.hpp"
#include "bench/spatial/our_structures.hpp"
#include "bench/spatial/our_world.hpp"
#include "bench/spatial/scene.hpp"

namespace hil::bench {
namespace {

/// Keeps the density constant for any count.
float half_size_m(std::uint32_t count) {
  return 0.5f * std::cbrt(100.0f * static_cast<float>(count));
}

std::vector<rtstdb::Pose> anywhere(std::uint32_t count, Random& random) {
  const glm::vec3 half_m(half_size_m(count));
  std::vector<rtstdb::Pose> places(count);
  for (rtstdb::Pose& place : places) {
    place.p_world_m = glm::dvec3(random.in_box(half_m));
    place.q_world =
        glm::angleAxis(static_cast<double>(random.between(-3.0f, 3.0f)), glm::dvec3(random.direction()));
  }
  return places;
}

/// Motions as within 10 ms: up to 0.2 m and 0.05 rad.
void move_a_little(std::span<rtstdb::Pose> places, Random& random) {
  for (rtstdb::Pose& place : places) {
    place.p_world_m += glm::dvec3(random.between(0.0f, 0.2f) * random.direction());
    place.q_world =
        glm::angleAxis(static_cast<double>(random.between(0.0f, 0.05f)), glm::dvec3(random.direction())) *
        place.q_world;
  }
}

enum class Change { anywhere, a_little };

std::vector<Figure> measure_tlas(const std::string& name, std::uint32_t count, Change change, int rounds) {
  const rtstdb::TriangleMesh mesh = lumpy_body(17, 16, 7);
  Random random(8);
  std::vector<rtstdb::Pose> places = anywhere(count, random);
  OurTlas ours(mesh, places, change == Change::a_little);
  EmbreeTlas theirs(mesh, places,
                    change == Change::a_little ? EmbreeTlas::Quality::refit : EmbreeTlas::Quality::low);
  std::vector<double> our_s, device_s, their_s;
  for (int round = -1; round < rounds; ++round) {
    if (change == Change::a_little) {
      move_a_little(places, random);
    } else {
      places = anywhere(count, random);
    }
    ours.place(places);
    theirs.place(places);
    double busy_s = 0.0;
    const RoundTimes times = once_each(
        round % 2 == 0, [&] { busy_s = ours.update(); }, [&] { theirs.update(); });
    if (round < 0) continue;  // warms up
    our_s.push_back(times.ours_s.front());
    their_s.push_back(times.theirs_s.front());
    device_s.push_back(busy_s);
  }
  return {time_figure(name, {our_s, their_s}, embree_version()),
          time_figure(name + "_device", {device_s, {}}, "")};
}

Figure measure_blas(const SuiteOptions& options) {
  const int rounds = options.tiny ? 1 : 9;
  const rtstdb::TriangleMesh mesh = bunny(options.tiny);
  OurWorld world(1, static_cast<std::uint32_t>(rounds) + 1);
  EmbreeBlas peer;
  const RoundTimes times = in_turns(
      rounds, [&] { world.add(mesh); }, [&] { peer.build(mesh); });
  return time_figure("blas_build_bunny", times, embree_version());
}

/// Waves that run over the body, with an amplitude of a tenth of its size.
void wave(std::span<const glm::vec3> rest_m, float phase, std::span<glm::vec3> positions_m) {
  for (std::size_t i = 0; i < rest_m.size(); ++i) {
    const glm::vec3 p = rest_m[i];
    positions_m[i] = p * (1.0f + 0.1f * std::sin(phase + 5.0f * (p.x + p.y + p.z)));
  }
}

std::vector<Figure> measure_blas_refit(const SuiteOptions& options) {
  const int rounds = options.tiny ? 1 : 31;
  const rtstdb::TriangleMesh mesh = bunny(options.tiny);
  OurDeforming ours(mesh);
  EmbreeDeforming theirs(mesh);
  std::vector<glm::vec3> positions_m = mesh.positions_m;
  std::vector<double> our_s, device_s, their_s;
  for (int round = -1; round < rounds; ++round) {
    wave(mesh.positions_m, 0.3f * static_cast<float>(round), positions_m);
    double busy_s = 0.0;
    const RoundTimes times = once_each(
        round % 2 == 0, [&] { busy_s = ours.update(positions_m); }, [&] { theirs.update(positions_m); });
    if (round < 0) continue;  // warms up
    our_s.push_back(times.ours_s.front());
    their_s.push_back(times.theirs_s.front());
    device_s.push_back(busy_s);
  }
  if (ours.builds() != 0) throw std::runtime_error("blas_refit_bunny: a tree was built anew");
  return {time_figure("blas_refit_bunny", {our_s, their_s}, embree_version()),
          time_figure("blas_refit_bunny_device", {device_s, {}}, "")};
}

}  // namespace

std::vector<Figure> measure_builds(const SuiteOptions& options) {
  struct Case {
    const char* name;
    std::uint32_t count;
    Change change;
  };
  const int rounds = options.tiny ? 1 : 21;
  const std::uint32_t few = options.tiny ? 200 : 10'000;
  std::vector<Figure> figures;
  for (const Case& one : {Case{"tlas_rebuild_10k", few, Change::anywhere},
                          Case{"tlas_rebuild_100k", 10 * few, Change::anywhere},
                          Case{"tlas_refit_10k", few, Change::a_little}}) {
    for (Figure& figure : measure_tlas(one.name, one.count, one.change, rounds))
      figures.push_back(std::move(figure));
  }
  figures.push_back(measure_blas(options));
  for (Figure& figure : measure_blas_refit(options))
    figures.push_back(std::move(figure));
  return figures;
}

}  // namespace hil::bench
