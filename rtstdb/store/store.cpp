#include "rtstdb/store/store.hpp"

#include <algorithm>
#include <utility>

#include <rtstdb/limits.hpp>
#include <rtstdb/result.hpp>

#include "rtstdb/geometry/row_check.hpp"
#include "rtstdb/store/motion_words.hpp"

namespace rtstdb::store {

namespace {

constexpr VersionInfo empty_world{0, world_time_ns(-max_world_time_ns)};

double seconds(WorldTime time) {
  return seconds_between(WorldTime{}, time);
}

bool within_limits(WorldTime time) {
  return time >= world_time_ns(-max_world_time_ns) && time <= world_time_ns(max_world_time_ns);
}

BadInput refusal(BadInputReason reason, double value = 0.0, double other_value = 0.0) {
  BadInput fault;
  fault.reason = reason;
  fault.values[0] = value;
  fault.values[1] = other_value;
  return fault;
}

EntityRow with_motion(EntityRow row, const Motion& motion) {
  row.motion = motion;
  return row;
}

BadInput time_out_of_limits(WorldTime time) {
  return refusal(BadInputReason::out_of_limits, seconds(time));
}

/// The state of an index whose entity was removed.
EntityState removed_state(EntityId last) {
  EntityState state;
  state.id.generation = last.generation;
  return state;
}

}  // namespace

Store::Store(StoreOptions options)
    : options_(std::move(options)),
      current_(options_.max_entities),
      generations_(options_.max_entities, 0),
      free_(options_.max_entities),
      changes_(options_.max_entities, options_.retained_changes),
      versions_(std::size_t{options_.retained_changes} + 1, empty_world),
      discarded_(options_.retained_changes),
      shapes_(options_.max_geometries),
      staged_write_(options_.max_entities, 0),
      staged_shape_(options_.max_geometries, 0),
      latest_(empty_world),
      marks_(options_.max_entities, 0) {
  RTSTDB_ASSERT(options_.max_entities <= max_entities, "more entities than max_entities");
  RTSTDB_ASSERT(options_.geometry_known && options_.material_known && options_.light_known,
                "a function that checks ids is missing");
}

void Store::restore(const RestoredRows& restored) noexcept {
  RTSTDB_ASSERT(progress_ == Progress::none && latest_.version == empty_world.version && next_version_ == 1,
                "the store is in use already");
  RTSTDB_ASSERT(
      restored.rows.size() <= current_.size() && restored.rows.size() == restored.generations.size(),
      "the rows exceed the capacity, or have another number than the generations");
  RTSTDB_ASSERT(restored.next_version > restored.latest.version,
                "the next version is not above the latest one");
  for (std::size_t index = 0; index < restored.rows.size(); ++index) {
    const EntityState& state = restored.rows[index];
    generations_[index] = restored.generations[index];
    current_[index].id.generation = restored.generations[index];
    if (!state.id.valid()) continue;
    RTSTDB_ASSERT(state.id.index == index && state.id.generation == restored.generations[index],
                  "a row has another index or generation than its place");
    current_[index] = state;
    free_.acquire(static_cast<std::uint32_t>(index));
  }
  index_limit_ = static_cast<std::uint32_t>(restored.rows.size());
  changes_.begin_at(restored.latest.version);
  versions_.begin_at(restored.latest);
  latest_ = restored.latest;
  next_version_ = restored.next_version;
}

// ---- reading

Snapshot Store::staged_snapshot() const noexcept {
  RTSTDB_ASSERT(progress_ != Progress::none, "no commit is staged");
  return {*this, {staged_->version, staged_->time}};
}

bool Store::keeps_after(Version version, const WriteSet& set) const noexcept {
  return changes_.keeps_after(version, set.writes.size()) && versions_.keeps_after_one_more(version) &&
         std::ranges::all_of(set.shapes, [&](const ShapeWrite& write) {
           return !shapes_.deforms(write.geometry) || shapes_.keeps_after_one_more(version, write.geometry);
         });
}

std::variant<Snapshot, BadInput> Store::read(const ReadAt& read_at, ReadFor purpose) const noexcept {
  if (read_at.kind == ReadAt::Kind::latest) return latest_snapshot();
  const bool by_time = read_at.kind == ReadAt::Kind::time;
  if (by_time && history_end_ && read_at.time >= *history_end_)
    return refusal(BadInputReason::beyond_history, seconds(read_at.time), seconds(*history_end_));
  if (by_time ? read_at.time >= latest_.time : read_at.version == latest_.version) return latest_snapshot();

  const auto found = by_time ? versions_.at_time(read_at.time) : versions_.find(read_at.version);
  const Version oldest_version =
      purpose == ReadFor::rows ? oldest_kept() : std::max(oldest_kept(), shapes_.oldest_kept());
  if (found && found->version >= oldest_version) return Snapshot(*this, *found);

  const VersionInfo oldest = versions_.find(oldest_version).value_or(latest_);
  const bool too_old =
      by_time ? found || oldest.version != empty_world.version : read_at.version < oldest.version;
  BadInput fault =
      refusal(too_old ? BadInputReason::snapshot_too_old : BadInputReason::unknown_version,
              by_time ? -1.0 : static_cast<double>(read_at.version), static_cast<double>(oldest.version));
  fault.version = by_time ? Version{0} : read_at.version;
  fault.values[2] = seconds(read_at.time);
  fault.values[3] = seconds(oldest.time);
  return fault;
}

bool Store::keeps(Version version) const noexcept {
  if (is_staged(version)) return true;
  return version >= oldest_kept() && versions_.find(version).has_value();
}

const EntityState* Store::row(Version version, std::uint32_t index) const noexcept {
  RTSTDB_ASSERT(index < index_limit_, "the index is beyond the last one");
  const EntityState* state = &current_[index];
  if (is_staged(version)) {
    if (const std::uint32_t ordinal = staged_write_[index]; ordinal != 0) {
      const Write& write = staged_->writes[ordinal - 1];
      return write.kind == WriteKind::remove ? nullptr : &write.state;
    }
  } else {
    RTSTDB_ASSERT(version >= oldest_kept(), "the version is older than the retained ones");
    state = &changes_.state_at(version, index, *state);
  }
  return state->id.valid() ? state : nullptr;
}

const EntityState& Store::slot(Version version, std::uint32_t index) const noexcept {
  RTSTDB_ASSERT(index < index_limit_ && !is_staged(version) && version >= oldest_kept(),
                "the index is beyond the last one, or the version is staged or older than the retained ones");
  return changes_.state_at(version, index, current_[index]);
}

Shape Store::shape(Version version, GeometryId geometry) const noexcept {
  if (is_staged(version)) {
    if (const std::uint32_t ordinal = staged_shape_[geometry.index]; ordinal != 0)
      return {version, staged_->shapes[ordinal - 1].positions_m};
  }
  return shapes_.at(geometry, version);
}

bool Store::changed_between(Version version, Version other,
                            std::vector<std::uint32_t>& indices) const noexcept {
  if (version == other) return true;
  const Version from = std::min(version, other);
  const Version to = std::max(version, other);
  if (from < oldest_kept() || (to >= next_version_ && !is_staged(to))) return false;
  const bool other_discarded = !is_staged(other) && !versions_.find(other);
  if (other_discarded && !discarded_.remembers(other)) return false;

  ++mark_;
  const auto name = [&](std::uint32_t index) {
    if (std::exchange(marks_[index], mark_) != mark_) indices.push_back(index);
  };
  changes_.for_each_between(from, to, name);
  if (is_staged(to)) for_each_staged_row([&](const Write& write) { name(write.state.id.index); });
  if (other_discarded) discarded_.for_each_of(other, name);
  return true;
}

// ---- committing

template <class Visit>
void Store::for_each_staged_row(Visit visit) const noexcept {
  for (std::size_t ordinal = 0; ordinal < staged_->writes.size(); ++ordinal) {
    const Write& write = staged_->writes[ordinal];
    if (staged_write_[write.state.id.index] == ordinal + 1) visit(write);
  }
}

std::optional<BadInput> Store::stage(WriteSet& set) noexcept {
  RTSTDB_ASSERT(progress_ == Progress::none, "a commit is staged already");
  RTSTDB_ASSERT(!set.empty(), "the commit has no writes");
  if (auto fault = check_time(set.time)) return fault;
  set.version = next_version_;
  staged_ = &set;
  for (std::size_t ordinal = 0; ordinal < set.writes.size(); ++ordinal) {
    Write& write = set.writes[ordinal];
    if (auto fault = stage_write(write)) {
      fault->element = static_cast<std::uint32_t>(ordinal);
      if (write.kind != WriteKind::create) fault->entity = write.state.id;
      unwind(ordinal);
      staged_ = nullptr;
      return fault;
    }
    write.state.written_by = set.version;
    staged_write_[write.state.id.index] = static_cast<std::uint32_t>(ordinal) + 1;
  }
  if (auto fault = stage_shapes()) {
    unwind(set.writes.size());
    staged_ = nullptr;
    return fault;
  }
  progress_ = Progress::staged;
  return std::nullopt;
}

void Store::restage(WriteSet& set) noexcept {
  RTSTDB_ASSERT(progress_ == Progress::none && !set.empty(),
                "a commit is staged already, or the commit has no writes");
  RTSTDB_ASSERT(set.version >= next_version_ && set.time >= latest_.time,
                "the version or the time of the commit is before the latest one");
  staged_ = &set;
  for (std::size_t ordinal = 0; ordinal < set.writes.size(); ++ordinal) {
    Write& write = set.writes[ordinal];
    const EntityId id = write.state.id;
    RTSTDB_ASSERT(id.index < options_.max_entities, "the index is beyond the capacity");
    if (write.kind == WriteKind::create) {
      ++generations_[id.index];
      RTSTDB_ASSERT(generations_[id.index] == id.generation,
                    "the generation is not the next one of the index");
      free_.acquire(id.index);
      index_limit_ = std::max(index_limit_, id.index + 1);
    } else {
      const EntityState* const before = find_staged(id);
      RTSTDB_ASSERT(before != nullptr, "the entity of a write does not exist");
      if (write.kind == WriteKind::remove) free_.release(id.index);
      if (write.kind == WriteKind::update_motion)
        write.state.row = with_motion(before->row, write.state.row.motion);
    }
    write.state.written_by = set.version;
    staged_write_[id.index] = static_cast<std::uint32_t>(ordinal) + 1;
  }
  for (std::size_t ordinal = 0; ordinal < set.shapes.size(); ++ordinal)
    staged_shape_[set.shapes[ordinal].geometry.index] = static_cast<std::uint32_t>(ordinal) + 1;
  progress_ = Progress::staged;
}

std::optional<BadInput> Store::check_time(WorldTime time) const noexcept {
  std::optional<BadInput> fault;
  if (!within_limits(time))
    fault = time_out_of_limits(time);
  else if (time < latest_.time)
    fault = refusal(BadInputReason::world_time_goes_back, seconds(time), seconds(latest_.time));
  if (fault) fault->element = BadInput::no_element;
  return fault;
}

std::optional<BadInput> Store::check_geometry(GeometryId geometry) const noexcept {
  if (options_.geometry_known(geometry)) return std::nullopt;
  return refusal(BadInputReason::unknown_geometry, static_cast<double>(geometry.index));
}

const EntityState* Store::find_staged(EntityId id) const noexcept {
  if (id.index >= index_limit_) return nullptr;
  const EntityState* state = &current_[id.index];
  if (const std::uint32_t ordinal = staged_write_[id.index]; ordinal != 0) {
    const Write& write = staged_->writes[ordinal - 1];
    if (write.kind == WriteKind::remove) return nullptr;
    state = &write.state;
  }
  return state->id == id ? state : nullptr;
}

std::optional<BadInput> Store::stage_write(Write& write) noexcept {
  if (write.kind == WriteKind::create) return stage_create(write);
  if (find_staged(write.state.id) == nullptr) return refusal(BadInputReason::unknown_entity);
  if (write.kind == WriteKind::update) return stage_update(write);
  if (write.kind == WriteKind::update_motion) return stage_update_motion(write);
  free_.release(write.state.id.index);
  return std::nullopt;
}

std::optional<BadInput> Store::stage_create(Write& write) noexcept {
  if (auto fault = stage_update(write)) return fault;
  const auto index = free_.acquire_lowest();
  if (!index) {
    return refusal(BadInputReason::too_many_entities, static_cast<double>(options_.max_entities));
  }
  write.state.id = {*index, ++generations_[*index]};
  index_limit_ = std::max(index_limit_, *index + 1);
  return std::nullopt;
}

std::optional<BadInput> Store::stage_update(Write& write) noexcept {
  EntityRow& row = write.state.row;
  if (auto fault = check_row(row)) return fault;
  if (auto fault = check_geometry(row.geometry)) return fault;
  if (!options_.material_known(row.material))
    return refusal(BadInputReason::unknown_material, static_cast<double>(row.material.index));
  if (row.light.valid() && !options_.light_known(row.light))
    return refusal(BadInputReason::unknown_light, static_cast<double>(row.light.index));
  if (!within_limits(row.motion.valid_from)) return time_out_of_limits(row.motion.valid_from);
  row = normalised(row);
  return std::nullopt;
}

std::optional<BadInput> Store::stage_update_motion(Write& write) noexcept {
  const Motion motion = write.state.row.motion;
  if (auto fault = check_motion(motion)) return fault;
  if (!within_limits(motion.valid_from)) return time_out_of_limits(motion.valid_from);
  const EntityState& before = *find_staged(write.state.id);
  const Motion after = normalised(motion);
  write.unchanged = same_words(words_of(before.row.motion), words_of(after));
  write.base_version_low = static_cast<std::uint16_t>(before.written_by);
  write.state.row = before.row;
  write.state.row.motion = after;
  return std::nullopt;
}

std::optional<BadInput> Store::stage_shapes() noexcept {
  for (std::size_t ordinal = 0; ordinal < staged_->shapes.size(); ++ordinal) {
    const ShapeWrite& write = staged_->shapes[ordinal];
    if (auto fault = check_shape(write)) {
      fault->element = static_cast<std::uint32_t>(ordinal);
      fault->in_geometry_update = true;
      return fault;
    }
    staged_shape_[write.geometry.index] = static_cast<std::uint32_t>(ordinal) + 1;
  }
  return std::nullopt;
}

std::optional<BadInput> Store::check_shape(const ShapeWrite& write) const noexcept {
  const auto index = static_cast<double>(write.geometry.index);
  if (!write.geometry.valid() || !options_.geometry_known(write.geometry))
    return refusal(BadInputReason::unknown_geometry, index);
  if (!shapes_.deforms(write.geometry)) return refusal(BadInputReason::geometry_does_not_deform, index);
  const std::size_t needed = shapes_.position_count(write.geometry);
  const auto given = static_cast<double>(write.given);
  if (write.given != needed)
    return refusal(BadInputReason::wrong_position_count, given, static_cast<double>(needed));
  if (write.given > write.space)
    return refusal(BadInputReason::too_many_positions, given, static_cast<double>(write.space));
  return check_positions(write.positions_m);
}

void Store::unwind(std::size_t count) noexcept {
  for (const ShapeWrite& write : staged_->shapes)
    if (write.geometry.index < staged_shape_.size()) staged_shape_[write.geometry.index] = 0;
  while (count-- > 0) {
    const Write& write = staged_->writes[count];
    const std::uint32_t index = write.state.id.index;
    staged_write_[index] = 0;
    if (write.kind == WriteKind::create) {
      --generations_[index];
      free_.release(index);
    } else if (write.kind == WriteKind::remove) {
      free_.acquire(index);
    }
  }
}

void Store::publish() noexcept {
  RTSTDB_ASSERT(progress_ == Progress::staged, "no commit is staged");
  progress_ = Progress::published;
  latest_ = {staged_->version, staged_->time};
}

void Store::complete_commit() noexcept {
  RTSTDB_ASSERT(progress_ == Progress::published, "no commit is published");
  for_each_staged_row([this](const Write& write) {
    EntityState& row = current_[write.state.id.index];
    changes_.record(staged_->version, write.state.id.index, row);
    row = write.kind == WriteKind::remove ? removed_state(write.state.id) : write.state;
  });
  for (const Write& write : staged_->writes)
    staged_write_[write.state.id.index] = 0;
  for (const ShapeWrite& write : staged_->shapes) {
    shapes_.record(staged_->version, write.geometry, write.positions_m);
    staged_shape_[write.geometry.index] = 0;
  }
  versions_.append(latest_);
  next_version_ = staged_->version + 1;
  progress_ = Progress::none;
  staged_ = nullptr;
}

void Store::discard() noexcept {
  RTSTDB_ASSERT(progress_ != Progress::none, "no commit is staged");
  for_each_staged_row(
      [this](const Write& write) { discarded_.record(staged_->version, write.state.id.index); });
  unwind(staged_->writes.size());
  latest_ = versions_.newest();
  next_version_ = staged_->version + 1;
  progress_ = Progress::none;
  staged_ = nullptr;
}

}  // namespace rtstdb::store
