#include "bench/spatial/rays.hpp"

#include <string>

#include "bench/spatial/embree_scene.hpp"
#include "bench/spatial/our_world.hpp"
#include "bench/spatial/ray_agreement.hpp"
#include "bench/spatial/scene.hpp"

namespace hil::bench {
namespace {

/// Rounding of coordinates of up to 3 m through a few operations.
constexpr double sideways_m = 2e-6;

class RayFigures {
 public:
  explicit RayFigures(const SuiteOptions& options)
      : rounds_(options.tiny ? 1 : 9),
        mesh_(body_in_bowl(options.tiny ? 24 : 180, 1)),
        world_(1),
        peer_(mesh_) {
    rtstdb::EntityRow row;
    row.geometry = world_.add(mesh_);
    world_.create({&row, 1});
  }

  void closest(const std::string& name, std::span<const rtstdb::Ray> rays) {
    auto ours = prepare_rays(world_, rays, rtstdb::RayMode::closest);
    std::vector<PeerHit> theirs(rays.size());
    const auto run_peer = [&] { peer_.closest(rays, theirs); };
    ours.run();
    run_peer();
    demand_same_closest(agreement(name, rays), ours.query().hits(), theirs);
    measure(name, rays.size(), ours, run_peer);
  }

  void any(const std::string& name, std::span<const rtstdb::Ray> rays) {
    auto ours = prepare_rays(world_, rays, rtstdb::RayMode::any);
    std::vector<PeerHit> theirs(rays.size());
    const auto run_peer = [&] { peer_.any(rays, theirs); };
    ours.run();
    run_peer();
    {
      auto ours_closest = prepare_rays(world_, rays, rtstdb::RayMode::closest);
      std::vector<PeerHit> theirs_closest(rays.size());
      ours_closest.run();
      peer_.closest(rays, theirs_closest);
      demand_same_any(agreement(name, rays), ours.query().hits(), theirs, ours_closest.query().hits(),
                      theirs_closest);
    }
    measure(name, rays.size(), ours, run_peer);
  }

  std::vector<Figure> take() { return std::move(figures_); }

 private:
  Agreement agreement(const std::string& name, std::span<const rtstdb::Ray> rays) const {
    return {name, sideways_m, [this, rays](std::size_t ray, const JudgedHit& claimed, double aside_m) {
              return lambda_doubt(mesh_, claimed.triangle, precise(rays[ray]), aside_m);
            }};
  }

  void measure(const std::string& name, std::size_t count, PreparedBatch<rtstdb::RayQuery>& ours,
               const std::function<void()>& run_peer) {
    const RateComparison comparison{
        name, mega_rays, count, rounds_, [&] { return ours.run(); }, embree_version(), run_peer};
    for (Figure& figure : rates(comparison))
      figures_.push_back(std::move(figure));
  }

  int rounds_;
  rtstdb::TriangleMesh mesh_;
  OurWorld world_;
  EmbreeScene peer_;
  std::vector<Figure> figures_;
};

}  // namespace

std::vector<Figure> measure_rays(const SuiteOptions& options) {
  const std::uint32_t side = options.tiny ? 64 : 1024;
  const auto coherent = camera_rays(side, side);
  const auto scattered = scattered_rays(side * side, 2);
  RayFigures figures(options);
  figures.closest("ray_closest_coherent", coherent);
  figures.closest("ray_closest_incoherent", scattered);
  figures.any("ray_any_incoherent", scattered);
  return figures.take();
}

}  // namespace hil::bench
