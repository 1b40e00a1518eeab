#pragma once
// Queries of every kind of rtstdb/query_kinds.def behind one interface, so that a test runs all kinds without
// a list of them. A new kind adds its tested options and its random elements to kind_cases.cpp, the words of
// its answers to answer_bits.hpp, and how they are judged and counted to database_fixture.hpp.

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "rtstdb/query/executor.hpp"
#include "rtstdb/query/gpu_executor.hpp"
#include "tests/gpu/answer_bits.hpp"
#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {

/// The options of a query of any kind.
#define QUERY_KIND(kind, Class, Element, elements, Answer, answers, ...) , Class##Options
using AnyQueryOptions = rtstdb::detail::VariantOfRest<void
#include <rtstdb/query_kinds.def>
                                                      >::type;
#undef QUERY_KIND

/// Where random elements lie: among these entities, at times from `first` to `first` + `window_s`.
struct ElementScene {
  std::span<const EntityState> entities;
  SceneOptions scene;
  WorldTime first{};
  double window_s = 0.0;
};

/// A prepared query of any kind.
class KindCase {
 public:
  virtual ~KindCase() = default;
  std::string name() const { return name_; }
  virtual Query& query() noexcept = 0;
  /// All elements of a batch are answered at once, with its last stage.
  virtual bool is_answered_whole() const noexcept = 0;
  query::PreparedQuery& prepared() { return dynamic_cast<query::PreparedQuery&>(query()); }
  std::uint32_t capacity() { return prepared().capacity(); }
  /// Fills all elements; equal states of `random` and equal scenes give equal elements.
  virtual void fill(Random& random, const ElementScene& scene) = 0;
  /// Copies the elements at these places of a query of the same kind to the places from `first` on.
  virtual void copy_elements(KindCase& from, std::span<const std::uint32_t> places,
                             std::uint32_t first = 0) = 0;
  /// The readable answers, bit for bit; `is_incomplete` holds for incomplete ones.
  virtual std::vector<Words> words() const = 0;
  /// Compares the readable answers with the oracle; leaves out incomplete ones if `skip_incomplete`.
  virtual Tally judge(const oracle::World& world, bool skip_incomplete = false) = 0;

 protected:
  explicit KindCase(std::string name) : name_(std::move(name)) {}

 private:
  std::string name_;
};

/// All tested options of all kinds: each uses other kernels or buffers. Capacities are not set.
std::vector<AnyQueryOptions> all_tested_options();
/// The first tested options of each kind.
std::vector<AnyQueryOptions> one_option_per_kind();
/// Whether an element takes the device at least as long as a hundred rays: contacts, impacts, images, and
/// exact fractions of cones.
bool is_expensive(const AnyQueryOptions& options);
AnyQueryOptions with(AnyQueryOptions options, std::uint32_t capacity, LatePolicy late = LatePolicy::discard);
std::string_view kind_name(const AnyQueryOptions& options);

/// Fails the test and returns null if the query can not be prepared.
std::unique_ptr<KindCase> prepare_case(Database& database, const AnyQueryOptions& options);
std::unique_ptr<KindCase> prepare_case(query::GpuExecutor& executor, const AnyQueryOptions& options);
/// Returns the error if the query can not be prepared.
Result<std::unique_ptr<KindCase>> try_to_prepare_case(Database& database, const AnyQueryOptions& options);

}  // namespace rtstdb::test
