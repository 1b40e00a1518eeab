#pragma once
// Every query kind as tests prepare it, from rtstdb/query_kinds.def: no test lists the kinds. A new kind adds
// to kind_cases.cpp the options that are worth a test and its random elements, to answer_words.hpp the words
// of its answers, and to database_test.hpp how they are judged and counted.

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
#include "tests/gpu/answer_words.hpp"
#include "tests/gpu/database_test.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {

/// The options of a query of any kind.
#define QUERY_KIND(kind, Class, Element, elements, Answer, answers, ...) , Class##Options
using AnyQueryOptions = rtstdb::detail::VariantOfRest<void
#include <rtstdb/query_kinds.def>
                                                      >::type;
#undef QUERY_KIND

/// Where random elements lie: among these entities, at times from `first` on.
struct ElementScene {
  std::span<const EntityState> entities;
  SceneOptions scene;
  WorldTime first{};
  double window_s = 0.0;
};

/// One prepared query of some kind.
class KindCase {
 public:
  virtual ~KindCase() = default;
  std::string name() const { return name_; }
  virtual Query& query() noexcept = 0;
  query::PreparedQuery& prepared() { return dynamic_cast<query::PreparedQuery&>(query()); }
  std::uint32_t capacity() { return prepared().capacity(); }
  /// Fills every element; the same state of `random` and the same scene give the same elements.
  virtual void fill(Random& random, const ElementScene& scene) = 0;
  /// The answers that may be read, bit for bit. Of an incomplete answer: is_cut_short.
  virtual std::vector<Words> words() const = 0;
  /// Holds the answers that may be read against the oracle.
  virtual Tally judge(const oracle::World& world) = 0;

 protected:
  explicit KindCase(std::string name) : name_(std::move(name)) {}

 private:
  std::string name_;
};

inline bool is_cut_short(const Words& words) {
  return words.empty() || words == cut_short;
}

/// The options that are worth a test, of every kind: each uses other kernels or buffers. Their capacity is
/// not set.
std::vector<AnyQueryOptions> options_of_every_kind();
/// The first of them of each kind.
std::vector<AnyQueryOptions> options_of_each_kind();
AnyQueryOptions with(AnyQueryOptions options, std::uint32_t capacity, LatePolicy late = LatePolicy::discard);
std::string_view kind_name(const AnyQueryOptions& options);

/// Fails the test and returns null where the query can not be prepared.
std::unique_ptr<KindCase> prepare_case(Database& database, const AnyQueryOptions& options);
std::unique_ptr<KindCase> prepare_case(query::GpuExecutor& executor, const AnyQueryOptions& options);
/// The same, with the error.
Result<std::unique_ptr<KindCase>> try_to_prepare_case(Database& database, const AnyQueryOptions& options);

}  // namespace rtstdb::test
