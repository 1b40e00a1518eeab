#include "bench/spatial/quality.hpp"

#include <string>

#include "bench/spatial/embree_hit.hpp"
#include "bench/spatial/embree_tree.hpp"
#include "bench/spatial/our_tree.hpp"
#include "bench/spatial/scene.hpp"

namespace hil::bench {

std::vector<Figure> measure_quality(const SuiteOptions& options) {
  struct Case {
    std::string name;
    rtstdb::TriangleMesh mesh;
  };
  std::vector<Figure> figures;
  for (const Case& one : {Case{"bunny", bunny(options.tiny)},
                          Case{"body", options.tiny ? lumpy_body(33, 32, 1) : lumpy_body(257, 256, 1)},
                          Case{"soup", triangle_soup(options.tiny ? 2'000 : 100'000, 10)}}) {
    const std::string name = "blas_sah_cost_" + one.name;
    const double ours = our_tree_cost(one.mesh);
    const auto beside = [&](const std::string& figure, EmbreeQuality quality) {
      figures.push_back(
          {figure, ours, "cost", embree_version(), embree_tree_cost(one.mesh, quality), Better::lower, 1});
    };
    beside(name, EmbreeQuality::medium);
    beside(name + "_split", EmbreeQuality::high);
  }
  return figures;
}

}  // namespace hil::bench
