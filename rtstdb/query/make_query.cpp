#include "rtstdb/query/make_query.hpp"

#include <variant>

#include "rtstdb/query/enumerator.hpp"

namespace rtstdb::query {

Result<std::unique_ptr<GpuQuery>> make_any_query(gpu::Device& device, QueryOptionsRef options) {
  return std::visit(
      [&](const auto* of_kind) -> Result<std::unique_ptr<GpuQuery>> {
        if (auto known = check_enumerator(of_kind->name, "late policy", of_kind->late, LatePolicy::partial);
            !known)
          return known.error();
        return make_query(device, *of_kind);
      },
      options);
}

}  // namespace rtstdb::query
