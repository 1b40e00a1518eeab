#include "live_world.hpp"

#include <bit>
#include <cstdio>
#include <cstring>

#include "rtstdb/log/geometry_file.hpp"
#include "rtstdb/store/motion_words.hpp"
#include "tests/support/simulation/same_state.hpp"

namespace rtstdb::log::test {

bool operator==(const Image& a, const Image& b) {
  const auto same_rows = [](const auto& x, const auto& y) {
    return x.first == y.first && hil::tests::same_state(x.second, y.second);
  };
  return a.latest.version == b.latest.version && a.latest.time == b.latest.time &&
         std::equal(a.rows.begin(), a.rows.end(), b.rows.begin(), b.rows.end(), same_rows) &&
         a.generations == b.generations && a.shapes == b.shapes;
}

Image image_of(const World& world) {
  Image image;
  image.latest = world.latest;
  for (std::uint32_t index = 0; index < world.rows.size(); ++index) {
    if (world.rows[index].id.valid()) image.rows[index] = world.rows[index];
    if (world.generations[index] != 0) image.generations[index] = world.generations[index];
  }
  for (const WorldGeometry& geometry : world.geometries)
    if (geometry.shape_version != 0)
      image.shapes[geometry.logged.id.index] = {geometry.shape_version, geometry.positions_m};
  return image;
}

std::string text_of(const World& world) {
  std::string text;
  char line[1024];
  const auto add = [&](int count) { text.append(line, static_cast<std::size_t>(count)); };
  add(std::snprintf(line, sizeof line, "version %llu time %lld next %llu\n",
                    static_cast<unsigned long long>(world.latest.version),
                    static_cast<long long>(world.latest.time.time_since_epoch().count()),
                    static_cast<unsigned long long>(world.next_version)));
  for (std::size_t index = 0; index < world.rows.size(); ++index) {
    const EntityState& state = world.rows[index];
    if (!state.id.valid()) {
      if (world.generations[index] != 0)
        add(std::snprintf(line, sizeof line, "free %zu generation %u\n", index, world.generations[index]));
      continue;
    }
    const EntityRow& row = state.row;
    const Motion& m = row.motion;
    add(std::snprintf(line, sizeof line,
                      "row %zu generation %u by %llu geometry %u mask %u material %u light %u", index,
                      state.id.generation, static_cast<unsigned long long>(state.written_by),
                      row.geometry.index, row.mask, row.material.index, row.light.index));
    for (const double value :
         {row.scale.x, row.scale.y, row.scale.z, m.p_world_m.x, m.p_world_m.y, m.p_world_m.z, m.q_world.w,
          m.q_world.x, m.q_world.y, m.q_world.z, m.v_world_mps.x, m.v_world_mps.y, m.v_world_mps.z,
          m.w_world_radps.x, m.w_world_radps.y, m.w_world_radps.z}) {
      std::uint64_t bits = 0;
      std::memcpy(&bits, &value, sizeof bits);
      add(std::snprintf(line, sizeof line, " %016llx", static_cast<unsigned long long>(bits)));
    }
    add(std::snprintf(line, sizeof line, " from %lld\n",
                      static_cast<long long>(m.valid_from.time_since_epoch().count())));
  }
  for (const WorldGeometry& geometry : world.geometries) {
    add(std::snprintf(line, sizeof line, "geometry %u %s positions %zu triangles %zu shape %llu",
                      geometry.logged.id.index, geometry.logged.name.c_str(),
                      geometry.mesh.positions_m.size(), geometry.mesh.triangles.size(),
                      static_cast<unsigned long long>(geometry.shape_version)));
    const auto add_vector = [&](const glm::vec3& vector) {
      std::uint32_t bits[3];
      std::memcpy(bits, &vector, sizeof bits);
      add(std::snprintf(line, sizeof line, " %08x%08x%08x", bits[0], bits[1], bits[2]));
    };
    std::ranges::for_each(geometry.positions_m, add_vector);
    text += " normals";
    for (const CornerValues& normals : geometry.mesh.corner_normals)
      std::ranges::for_each(normals, add_vector);
    text += " colors";
    for (const CornerValues& colors : geometry.mesh.corner_colors)
      std::ranges::for_each(colors, add_vector);
    text += '\n';
  }
  const auto add_bits = [&](std::initializer_list<double> values) {
    for (const double value : values)
      add(std::snprintf(line, sizeof line, " %016llx",
                        static_cast<unsigned long long>(std::bit_cast<std::uint64_t>(value))));
  };
  for (const LoggedMaterial& material : world.materials) {
    const Material& m = material.value;
    add(std::snprintf(line, sizeof line, "material %u %s 0", material.id.index, material.name.c_str()));
    add_bits({m.reflectance, m.retro_gain, m.base_color.r, m.base_color.g, m.base_color.b, m.metallic,
              m.roughness, m.emission_cdpm2.r, m.emission_cdpm2.g, m.emission_cdpm2.b, m.transmission,
              m.refractive_index});
    text += '\n';
  }
  for (const LoggedLight& light : world.lights) {
    const Light& l = light.value;
    add(std::snprintf(line, sizeof line, "light %u %s %d", light.id.index, light.name.c_str(),
                      static_cast<int>(l.kind) + 1));
    add_bits({l.color.r, l.color.g, l.color.b, l.illuminance_lx, l.intensity_cd, l.inner_angle_rad,
              l.outer_angle_rad, l.angular_diameter_rad});
    for (const glm::dvec3& channels : {l.zenith_cdpm2, l.horizon_cdpm2, l.ground_cdpm2, l.p_m})
      add_bits({channels.r, channels.g, channels.b});
    text += '\n';
  }
  return text;
}

void History::forget_after(Version version) {
  images.erase(images.upper_bound(version), images.end());
  valid.erase(valid.upper_bound(version), valid.end());
}

Version History::newest_valid(Version up_to) const {
  const auto after = valid.upper_bound(up_to);
  return after == valid.begin() ? 0 : *std::prev(after);
}

Version History::newest_at(WorldTime time) const {
  Version newest = 0;
  for (const Version version : valid)
    if (images.at(version).latest.time <= time) newest = version;
  return newest;
}

LiveWorld::LiveWorld(std::uint64_t seed, History& history, std::size_t ring_bytes)
    : random_(seed),
      history_(history),
      store_(
          {.max_entities = live_entities,
           .retained_changes = 256,
           .geometry_known = [this](GeometryId id) { return !id.valid() || id.index < geometries_.size(); },
           .material_known = [this](MaterialId id) { return id.index <= materials_.size(); },
           .light_known = [this](LightId id) { return id.index < lights_.size(); },
           .max_geometries = 16}),
      generations_(live_entities, 0),
      ring_(ring_bytes),
      recorder_(ring_) {
  history_.images.try_emplace(0, image_of(World{}));
}

LiveWorld::LiveWorld(std::uint64_t seed, History& history, std::size_t ring_bytes, const Recovered& recovered)
    : LiveWorld(seed, history, ring_bytes) {
  const World& world = recovered.world;
  for (const WorldGeometry& geometry : world.geometries) {
    geometries_.push_back(geometry.logged);
    if (geometry.logged.options.deforms)
      keep_shapes(geometry.logged, world.shape_of(geometry), geometry.shape_version);
  }
  materials_ = world.materials;
  lights_ = world.lights;
  store_.restore(world.restored());
  std::copy(world.generations.begin(), world.generations.end(), generations_.begin());
  next_version_ = world.next_version;
}

void LiveWorld::keep_shapes(const LoggedGeometry& geometry, std::span<const glm::vec3> positions_m,
                            Version version) {
  store_.keep_shapes(geometry.id,
                     store::ShapeHistory::make(positions_m, geometry.options.retained_shapes, version));
  positions_of_[geometry.id.index] = positions_m.size();
}

EntityRow LiveWorld::random_row() {
  std::uniform_real_distribution<double> number(-100.0, 100.0);
  EntityRow row;
  if (!geometries_.empty() && below(4) != 0)
    row.geometry = {below(static_cast<std::uint32_t>(geometries_.size()))};
  row.scale = {1.0 + below(5), 1.0, 0.5};
  row.mask = static_cast<std::uint32_t>(random_());
  row.material = {below(static_cast<std::uint32_t>(materials_.size()) + 1)};
  if (!lights_.empty() && below(2) == 0) row.light = {below(static_cast<std::uint32_t>(lights_.size()))};
  row.motion.p_world_m = {number(random_), number(random_), number(random_)};
  row.motion.q_world = {number(random_), number(random_), number(random_), 1.0};
  row.motion.v_world_mps = {number(random_), 0.0, -0.0};
  row.motion.w_world_radps = {0.0, number(random_), 0.0};
  row.motion.valid_from = world_time_ns(static_cast<std::int64_t>(random_() % 1'000'000));
  return row;
}

EntityRow LiveWorld::moved(EntityId entity) {
  EntityRow row = random_row();
  if (below(3) == 0) return row;
  store::MotionWords words = store::words_of(row.motion);
  const store::MotionWords before = store::words_of(store_.latest_snapshot().row(entity.index)->row.motion);
  const bool turns = below(2) == 0;  // a part of a quaternion would not be normalised
  for (std::size_t k = 0; k < words.size(); ++k) {
    const bool of_orientation = k >= 3 && k <= 6;
    if (of_orientation ? !turns : below(3) != 0) words[k] = before[k];
  }
  row.motion = store::motion_of(words);
  return row;
}

void LiveWorld::record(const store::WriteSet& set, bool may_collect) {
  const bool collects = may_collect && collects_some_ && below(2) == 0;
  if (!collects || !recorder_.collect(set)) recorder_.record(set);
}

store::WriteSet LiveWorld::random_set() {
  using store::WriteKind;
  const auto latest_ns = std::max<std::int64_t>(store_.latest().time.time_since_epoch().count(), 0);
  store::WriteSet set{0, world_time_ns(latest_ns + below(3)), {}};
  std::map<std::uint32_t, EntityId> existing;
  for (std::uint32_t index = 0; index < store_.latest_snapshot().index_limit(); ++index)
    if (const EntityState* state = store_.latest_snapshot().row(index)) existing[index] = state->id;
  std::size_t count = existing.size();
  for (std::uint32_t k = 1 + below(3); k > 0; --k) {
    const auto chosen = existing.empty()
                            ? existing.end()
                            : std::next(existing.begin(), below(static_cast<std::uint32_t>(existing.size())));
    const std::uint32_t kind = below(8);
    if (chosen == existing.end() || kind < 2) {
      if (count == live_entities) continue;
      set.writes.push_back({WriteKind::create, {EntityId{}, random_row(), 0}});
      ++count;
    } else if (kind < 7) {
      const bool known = store_.latest_snapshot().row(chosen->first) != nullptr;
      if (kind < 5) {
        set.writes.push_back(
            {WriteKind::update_motion, {chosen->second, known ? moved(chosen->second) : random_row(), 0}});
      } else {
        set.writes.push_back({WriteKind::update, {chosen->second, random_row(), 0}});
      }
    } else {
      set.writes.push_back({WriteKind::remove, {chosen->second, {}, 0}});
      existing.erase(chosen);
      --count;
    }
  }
  if (!positions_of_.empty() && (set.writes.empty() || below(4) == 0)) {
    const auto& [geometry, positions] =
        *std::next(positions_of_.begin(), below(static_cast<std::uint32_t>(positions_of_.size())));
    auto& shape = shapes_to_write_[geometry];
    shape.resize(positions);
    for (glm::vec3& position : shape)
      position = {static_cast<float>(below(100)), 1.5f, -2.0f};
    set.shapes.push_back({{geometry}, positions, positions, shape});
  }
  if (set.empty()) set.writes.push_back({WriteKind::update, {existing.begin()->second, random_row(), 0}});
  for (store::Write& write : set.writes)
    if (below(3) == 0) write.state.row.motion.valid_from = set.time;
  return set;
}

Image LiveWorld::image() const {
  Image image;
  const store::Snapshot snapshot = store_.latest_snapshot();
  image.latest = store_.latest();
  for (std::uint32_t index = 0; index < snapshot.index_limit(); ++index) {
    if (const EntityState* state = snapshot.row(index)) image.rows[index] = *state;
    if (generations_[index] != 0) image.generations[index] = generations_[index];
  }
  for (const auto& [geometry, positions] : positions_of_) {
    const store::Shape shape = snapshot.shape({geometry});
    if (shape.version != 0)
      image.shapes[geometry] = {shape.version, {shape.positions_m.begin(), shape.positions_m.end()}};
  }
  return image;
}

void LiveWorld::commit() {
  commit(random_set());
}

void LiveWorld::commit_move() {
  std::uint32_t index = 0;
  while (store_.latest_snapshot().row(index) == nullptr)
    ++index;
  EntityState state = *store_.latest_snapshot().row(index);
  state.row.motion.p_world_m.x += 1.0;
  commit({0, store_.latest().time, {{store::WriteKind::update_motion, state}}});
}

void LiveWorld::commit(store::WriteSet set) {
  const auto fault = store_.stage(set);
  RTSTDB_ASSERT(!fault, "the store refused the commit");
  store_.publish();
  store_.complete_commit();
  for (const store::Write& write : set.writes)
    if (write.kind == store::WriteKind::create)
      generations_[write.state.id.index] = write.state.id.generation;
  next_version_ = set.version + 1;
  history_.images[set.version] = image();
  history_.valid.insert(set.version);
  record(set, true);
}

void LiveWorld::commit_and_discard(const std::function<void()>& between) {
  store::WriteSet set = random_set();
  const auto fault = store_.stage(set);
  RTSTDB_ASSERT(!fault, "the store refused the commit");
  if (!recorder_.has_space_for(set)) {
    store_.discard();
    next_version_ = set.version + 1;
    return;
  }
  record(set, false);
  // Until the discard is in the log, the version may exist after a crash.
  const std::vector<std::uint32_t> generations = generations_;
  for (const store::Write& write : set.writes)
    if (write.kind == store::WriteKind::create)
      generations_[write.state.id.index] = write.state.id.generation;
  store_.publish();
  history_.images[set.version] = image();
  store_.discard();
  generations_ = generations;
  next_version_ = set.version + 1;
  between();
  recorder_.discard(set.version);
}

bool LiveWorld::add_geometry(Disk& disk, std::uint64_t database_id, std::uint64_t file) {
  if (geometries_.size() == 8) return false;
  TriangleMesh mesh = below(2) == 0 ? make_box({1.0, 2.0, 3.0}) : make_rectangle(1.0, 1.0);
  const auto of_file = static_cast<float>(file);
  const std::size_t triangles = mesh.triangles.size();
  if (file % 4 >= 2)
    mesh.corner_normals.resize(triangles, {glm::vec3(of_file), glm::vec3(0, 1, 0), glm::vec3(1)});
  if (file % 2 == 0)
    mesh.corner_colors.resize(triangles, {glm::vec3(1.0f / of_file), glm::vec3(0), glm::vec3(1)});
  LoggedGeometry geometry;
  geometry.id = {static_cast<std::uint32_t>(geometries_.size())};
  geometry.name = "geometry_" + std::to_string(file);
  geometry.options.deforms = below(2) == 0;
  geometry.file = file;
  auto checksum = write_geometry_file(disk, database_id, file, mesh);
  if (!checksum) return false;
  geometry.file_checksum = checksum.value();
  if (!recorder_.record(geometry)) return false;
  geometries_.push_back(geometry);
  if (geometry.options.deforms) keep_shapes(geometry, mesh.positions_m, 0);
  return true;
}

bool LiveWorld::add_material() {
  if (materials_.size() == 8) return false;
  LoggedMaterial material;
  material.id = {static_cast<std::uint32_t>(materials_.size()) + 1};
  material.name = "material_" + std::to_string(materials_.size());
  material.value.reflectance = 0.1 * below(11);
  if (below(2) == 0) material.value.retro_gain = 1.0 + below(500);
  if (below(2) == 0) material.value.base_color = random_color();
  if (below(2) == 0) material.value.emission_cdpm2 = random_color();
  if (below(2) == 0) material.value.metallic = 1.0;
  if (below(2) == 0) material.value.roughness = 0.1 * below(11);
  if (below(2) == 0) material.value.transmission = 0.5;
  if (below(2) == 0) material.value.refractive_index = 1.25;
  if (!recorder_.record(material)) return false;
  materials_.push_back(material);
  return true;
}

bool LiveWorld::add_light() {
  if (lights_.size() == 8) return false;
  LoggedLight light;
  light.id = {static_cast<std::uint32_t>(lights_.size())};
  light.name = "light_" + std::to_string(lights_.size());
  Light& value = light.value;
  value.kind = static_cast<LightKind>(below(4));
  if (value.kind == LightKind::sky) {
    value.zenith_cdpm2 = random_color();
    value.horizon_cdpm2 = random_color();
    value.ground_cdpm2 = random_color();
  } else if (below(2) == 0) {
    value.color = random_color();
  }
  if (value.kind == LightKind::directional) {
    value.illuminance_lx = 1.0 + below(500);
    value.angular_diameter_rad = 0.01 * below(20);
  }
  if (value.kind == LightKind::point || value.kind == LightKind::spot) {
    value.intensity_cd = 1.0 + below(500);
    value.p_m = glm::dvec3(1.0 - below(3), 0.25 * below(3), below(2));
  }
  if (value.kind == LightKind::spot) {
    value.inner_angle_rad = 0.1 * below(5);
    value.outer_angle_rad = 0.5;
  }
  if (!recorder_.record(light)) return false;
  lights_.push_back(light);
  return true;
}

// ---- checkpoints

std::optional<WorldHead> LiveWorld::begin(Version not_before) {
  if (latest() < not_before) return std::nullopt;
  checkpoint_ = image();
  WorldHead head;
  head.version = checkpoint_.latest;
  head.next_version = next_version_;
  head.index_limit = store_.latest_snapshot().index_limit();
  head.geometries = geometries_;
  head.materials = materials_;
  head.lights = lights_;
  return head;
}

bool LiveWorld::rows(std::uint32_t first, std::span<EntityState> states) {
  for (std::uint32_t k = 0; k < states.size(); ++k) {
    const auto row = checkpoint_.rows.find(first + k);
    const auto generation = checkpoint_.generations.find(first + k);
    states[k] = row != checkpoint_.rows.end() ? row->second : EntityState{};
    if (row == checkpoint_.rows.end())
      states[k].id.generation = generation != checkpoint_.generations.end() ? generation->second : 0;
  }
  return !slice_is_lost();
}

bool LiveWorld::shape(GeometryId geometry, Shape& shape) {
  const auto found = checkpoint_.shapes.find(geometry.index);
  shape = found == checkpoint_.shapes.end() ? Shape{} : Shape{found->second.first, found->second.second};
  return !slice_is_lost();
}

}  // namespace rtstdb::log::test
