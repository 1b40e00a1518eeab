#include "tests/long/world_model.hpp"

#include <iterator>
#include <utility>

namespace hil::long_test {

namespace {

constexpr std::uint64_t mix(std::uint64_t number) {
  number = (number ^ (number >> 30)) * 0xBF58476D1CE4E5B9u;
  number = (number ^ (number >> 27)) * 0x94D049BB133111EBu;
  return number ^ (number >> 31);
}

std::string name(rtstdb::EntityId id) {
  return "entity " + std::to_string(id.index) + "." + std::to_string(id.generation);
}

}  // namespace

std::uint64_t row_digest(rtstdb::EntityId id, std::uint32_t mask, rtstdb::Version written_by) {
  return mix(mix(mix(id.index + 1) + id.generation) + mask) + mix(written_by);
}

std::uint64_t digest(const ModelRows& rows) {
  std::uint64_t sum = 0;
  for (const auto& [index, row] : rows)
    sum += row_digest({index, row.generation}, row.mask, row.written_by);
  return sum;
}

std::string WorldModel::commit(rtstdb::Version version, const std::vector<ModelWrite>& writes) {
  const auto& [newest, before] = *versions_.rbegin();
  if (version <= newest)
    return "version " + std::to_string(version) + " was committed after " + std::to_string(newest);
  VersionState after = before;
  if (std::string wrong = apply(version, writes, after.rows); !wrong.empty()) return wrong;
  after.digest = long_test::digest(after.rows);
  versions_.emplace(version, std::move(after));
  return {};
}

void WorldModel::note_in_doubt(rtstdb::Version version, const std::vector<ModelWrite>& writes) {
  VersionState after = held(version);
  if (!apply(version, writes, after.rows).empty()) return;  // not a valid version: recovering it is a fault
  after.digest = long_test::digest(after.rows);
  in_doubt_.insert_or_assign(version, std::move(after));
}

std::string WorldModel::recover_at(rtstdb::Version version) {
  const auto after = versions_.upper_bound(version);
  if (after == versions_.begin())
    return "version " + std::to_string(version) + " is older than every version of the model";
  versions_.erase(after, versions_.end());
  const auto found_in_doubt = in_doubt_.find(version);
  if (newest() != version && found_in_doubt == in_doubt_.end())
    return "version " + std::to_string(version) + " was not committed; the version before it is " +
           std::to_string(newest());
  if (newest() != version) versions_.emplace(version, std::move(found_in_doubt->second));
  in_doubt_.clear();
  return {};
}

std::string WorldModel::apply(rtstdb::Version version, const std::vector<ModelWrite>& writes,
                              ModelRows& rows) {
  for (const ModelWrite& write : writes) {
    const auto found = rows.find(write.id.index);
    const bool alive = found != rows.end() && found->second.generation == write.id.generation;
    if (write.kind == ModelWrite::Kind::create) {
      if (found != rows.end()) return name(write.id) + " was created at the index of another entity";
      rows[write.id.index] = {write.id.generation, write.mask, version};
      continue;
    }
    if (!alive) return name(write.id) + " was written and does not exist";
    if (write.kind == ModelWrite::Kind::remove)
      rows.erase(found);
    else
      found->second = {write.id.generation, write.mask, version};
  }
  return {};
}

const WorldModel::VersionState& WorldModel::held(rtstdb::Version version) const {
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

bool WorldModel::exists_since(rtstdb::EntityId id, rtstdb::Version version) const {
  for (auto held = std::prev(versions_.upper_bound(version)); held != versions_.end(); ++held) {
    const auto found = held->second.rows.find(id.index);
    if (found == held->second.rows.end() || found->second.generation != id.generation) return false;
  }
  return true;
}

void WorldModel::forget_before(rtstdb::Version version) {
  versions_.erase(versions_.begin(), std::prev(versions_.upper_bound(version)));
}

}  // namespace hil::long_test
