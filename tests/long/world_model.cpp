#include "tests/long/world_model.hpp"

#include <iterator>
#include <utility>

namespace hil::stress {

namespace {

constexpr std::uint64_t spread(std::uint64_t number) {
  number = (number ^ (number >> 30)) * 0xBF58476D1CE4E5B9u;
  number = (number ^ (number >> 27)) * 0x94D049BB133111EBu;
  return number ^ (number >> 31);
}

std::string name(rtstdb::EntityId id) {
  return "entity " + std::to_string(id.index) + "." + std::to_string(id.generation);
}

}  // namespace

std::uint64_t row_digest(rtstdb::EntityId id, std::uint32_t material, rtstdb::Version written_by) {
  return spread(spread(spread(id.index + 1) + id.generation) + material) + spread(written_by);
}

std::uint64_t digest(const ModelRows& rows) {
  std::uint64_t sum = 0;
  for (const auto& [index, row] : rows)
    sum += row_digest({index, row.generation}, row.material, row.written_by);
  return sum;
}

std::string WorldModel::commit(rtstdb::Version version, const std::vector<ModelWrite>& writes) {
  const auto& [newest, before] = *versions_.rbegin();
  if (version <= newest)
    return "version " + std::to_string(version) + " was committed after " + std::to_string(newest);
  Held after = before;
  if (std::string wrong = apply(version, writes, after.rows); !wrong.empty()) return wrong;
  after.digest = stress::digest(after.rows);
  versions_.emplace(version, std::move(after));
  return {};
}

void WorldModel::may_stand(rtstdb::Version version, const std::vector<ModelWrite>& writes) {
  Held after = held(version);
  if (!apply(version, writes, after.rows).empty()) return;  // then nothing may stand, and finding it is wrong
  after.digest = stress::digest(after.rows);
  doubtful_.insert_or_assign(version, std::move(after));
}

std::string WorldModel::go_on_at(rtstdb::Version version) {
  const auto after = versions_.upper_bound(version);
  if (after == versions_.begin())
    return "version " + std::to_string(version) + " is older than any that may be found";
  versions_.erase(after, versions_.end());
  const auto doubtful = doubtful_.find(version);
  if (newest() != version && doubtful == doubtful_.end())
    return "version " + std::to_string(version) + " never was; the one before it is " +
           std::to_string(newest());
  if (newest() != version) versions_.emplace(version, std::move(doubtful->second));
  doubtful_.clear();
  return {};
}

std::string WorldModel::apply(rtstdb::Version version, const std::vector<ModelWrite>& writes,
                              ModelRows& rows) {
  for (const ModelWrite& write : writes) {
    const auto found = rows.find(write.id.index);
    const bool alive = found != rows.end() && found->second.generation == write.id.generation;
    if (write.kind == ModelWrite::Kind::create) {
      if (found != rows.end()) return name(write.id) + " was created where one lives";
      rows[write.id.index] = {write.id.generation, write.material, version};
      continue;
    }
    if (!alive) return name(write.id) + " was written and is not there";
    if (write.kind == ModelWrite::Kind::remove)
      rows.erase(found);
    else
      found->second = {write.id.generation, write.material, version};
  }
  return {};
}

const WorldModel::Held& WorldModel::held(rtstdb::Version version) const {
  return std::prev(versions_.upper_bound(version))->second;
}

const ModelRows& WorldModel::rows(rtstdb::Version version) const {
  return held(version).rows;
}

std::uint64_t WorldModel::digest(rtstdb::Version version) const {
  return held(version).digest;
}

rtstdb::Version WorldModel::before(rtstdb::Version version) const {
  return std::prev(versions_.lower_bound(version))->first;
}

bool WorldModel::lives_since(rtstdb::EntityId id, rtstdb::Version version) const {
  for (auto held = std::prev(versions_.upper_bound(version)); held != versions_.end(); ++held) {
    const auto found = held->second.rows.find(id.index);
    if (found == held->second.rows.end() || found->second.generation != id.generation) return false;
  }
  return true;
}

void WorldModel::forget_before(rtstdb::Version version) {
  versions_.erase(versions_.begin(), std::prev(versions_.upper_bound(version)));
}

}  // namespace hil::stress
