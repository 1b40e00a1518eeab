#include "runtime/modules/named_world.hpp"

#include <algorithm>

#include <hil/module.hpp>
#include <hil/require.hpp>

namespace hil::modules {
namespace {

rtstdb::Error error_of(const rtstdb::Outcome& outcome) {
  const bool by_log =
      outcome.refused_by == rtstdb::RefusedBy::log_full || outcome.refused_by == rtstdb::RefusedBy::log_fault;
  return {outcome.status == rtstdb::Status::device_lost ? rtstdb::ErrorCode::device_lost
          : by_log                                      ? rtstdb::ErrorCode::file
                                                        : rtstdb::ErrorCode::bad_input,
          rtstdb::describe(outcome)};
}

/// Of a material or a light. Throws SetupError for an unknown name.
template <class Id>
Id id_of(const std::unordered_map<std::string, Id>& ids, const std::string& noun, const std::string& name,
         const std::string& caller) {
  const auto found = ids.find(name);
  if (found != ids.end()) return found->second;
  std::vector<std::string> known;
  for (const auto& [known_name, id] : ids)
    known.push_back(known_name);
  std::ranges::sort(known);
  throw SetupError(caller + ": world." + noun + "s has no " + noun + " '" + name + "'" +
                   config::suggestion(name, known));
}

}  // namespace

NamedWorld::NamedWorld(rtstdb::Database* database, std::vector<std::string> layers)
    : database_(database), layers_(std::move(layers)) {
  if (database_ != nullptr) creation_ = database_->make_transaction({.max_writes = 1});
}

rtstdb::Database& NamedWorld::database() noexcept {
  config::require(database_ != nullptr, "a run with a database");
  return *database_;
}

std::optional<std::uint32_t> NamedWorld::layer_bit(const std::string& layer) const {
  const auto found = std::find(layers_.begin(), layers_.end(), layer);
  if (found == layers_.end()) return std::nullopt;
  return 1u << (found - layers_.begin());
}

std::uint32_t NamedWorld::mask_of(const std::vector<std::string>& layers, const std::string& caller) const {
  std::uint32_t mask = 0;
  for (const std::string& layer : layers) {
    const auto bit = layer_bit(layer);
    if (!bit) {
      std::string fault = caller;
      fault += ": the scenario has no layer '" + layer + "'" + config::suggestion(layer, layers_);
      throw SetupError(fault);
    }
    mask |= *bit;
  }
  return mask;
}

rtstdb::GeometryId NamedWorld::add_geometry(const rtstdb::TriangleMesh& mesh, const std::string& name,
                                            const rtstdb::GeometryOptions& options) {
  auto added = database().add_geometry(mesh, name, options);
  if (!added) throw RefusedByDatabase(name, added.error());
  geometry_bounds_.resize(std::max<std::size_t>(geometry_bounds_.size(), added.value().index + 1));
  geometry_bounds_[added.value().index] = rtstdb::bounds_of(mesh);
  return added.value();
}

rtstdb::GeometryId NamedWorld::shared_geometry(const std::string& key,
                                               const std::function<rtstdb::TriangleMesh()>& make) {
  const auto known = shared_.find(key);
  if (known != shared_.end()) return known->second;
  return shared_.emplace(key, add_geometry(make(), key)).first->second;
}

rtstdb::MaterialId NamedWorld::add_material(const std::string& name, const rtstdb::Material& material) {
  if (materials_.contains(name)) throw SetupError("two materials have the name '" + name + "'");
  auto added = database().add_material(material, name);
  if (!added) throw RefusedByDatabase("world.materials", added.error());
  return materials_.emplace(name, added.value()).first->second;
}

rtstdb::MaterialId NamedWorld::material_of(const std::string& name, const std::string& caller) const {
  return id_of(materials_, "material", name, caller);
}

rtstdb::LightId NamedWorld::add_light(const std::string& name, const rtstdb::Light& light) {
  if (lights_.contains(name)) throw SetupError("two lights have the name '" + name + "'");
  auto added = database().add_light(light, name);
  if (!added) throw RefusedByDatabase("world.lights", added.error());
  return lights_.emplace(name, added.value()).first->second;
}

rtstdb::LightId NamedWorld::light_of(const std::string& name, const std::string& caller) const {
  return id_of(lights_, "light", name, caller);
}

rtstdb::Reservation* NamedWorld::reserve(const rtstdb::ReservationOptions& options) {
  auto reservation = database().reserve(options);
  if (!reservation) {
    not_reserved_.push_back(reservation.error().message);
    return nullptr;
  }
  reservations_.push_back(std::move(reservation).value());
  return reservations_.back().get();
}

rtstdb::EntityId NamedWorld::create(const std::string& name, const rtstdb::EntityRow& row) {
  if (by_name_.contains(name)) throw SetupError("two entities have the name '" + name + "'");
  creation_->begin({});
  const std::uint32_t ordinal = creation_->create(row);
  const rtstdb::Outcome& outcome = database().execute(*creation_);
  if (!outcome.done()) throw RefusedByDatabase("entity '" + name + "'", error_of(outcome));
  const rtstdb::EntityId entity = creation_->created(ordinal);
  by_name_.emplace(name, entity);
  const std::size_t needed = std::max<std::size_t>(names_.size(), entity.index + 1);
  names_.resize(needed);
  geometry_of_entity_.resize(needed);
  generations_.resize(needed);
  names_[entity.index] = name;
  generations_[entity.index] = entity.generation;
  geometry_of_entity_[entity.index] = row.geometry.index;
  return entity;
}

std::optional<rtstdb::EntityId> NamedWorld::find(const std::string& name) const {
  const auto found = by_name_.find(name);
  if (found == by_name_.end()) return std::nullopt;
  return found->second;
}

rtstdb::EntityId NamedWorld::entity_of(const std::string& name, const std::string& caller) const {
  if (const auto entity = find(name)) return *entity;
  throw SetupError(caller + ": there is no body '" + name + "' in world.entities or of an earlier module");
}

const std::string& NamedWorld::name_of(rtstdb::EntityId entity) const {
  static const std::string unnamed;
  return entity.index < names_.size() ? names_[entity.index] : unnamed;
}

void NamedWorld::describe(contribution::WorldRecord& record) const {
  record.layers = layers_;
  for (std::uint32_t index = 0; index < names_.size(); ++index)
    if (!names_[index].empty()) record.entities.push_back({names_[index], index, generations_[index]});
}

rtstdb::Bounds NamedWorld::bounds_of(rtstdb::EntityId entity) const {
  return geometry_bounds_[geometry_of_entity_[entity.index]];
}

std::uint32_t NamedWorld::convex_parts_of(rtstdb::EntityId entity) const {
  const auto info = database_->geometry_info({geometry_of_entity_[entity.index]});
  return info ? info->convex_parts : 0;
}

}  // namespace hil::modules
