#include "runtime/run/world_wiring.hpp"

#include <algorithm>
#include <map>
#include <unordered_set>

#include <rtstdb/limits.hpp>

namespace hil::run {
namespace {

using config::Diagnostics;
using config::Word;

/// A module without a world names and makes nothing in it.
const modules::WorldPorts& world_ports(const WiredModule& wired) {
  static const modules::WorldPorts none;
  const modules::WorldModule* const module = wired.module->world_module();
  return module == nullptr ? none : module->ports();
}

bool all_modules_exist(const Wiring& wiring) {
  return std::none_of(wiring.modules.begin(), wiring.modules.end(),
                      [](const WiredModule& wired) { return wired.module == nullptr; });
}

/// The layers of bodies that modules create have to be layers of the scenario; a scenario that lists none
/// gets them.
void add_layers(Wiring& wiring, Diagnostics& diagnostics) {
  const config::World& world = wiring.scenario->world;
  wiring.layers = world.layers;
  for (const WiredModule& wired : wiring.modules) {
    if (wired.module == nullptr) continue;
    std::string reported;  // one mistake for all bodies in one layer
    for (const Word& layer : world_ports(wired).layers_of_made) {
      const bool has_bit =
          (world.layers_are_listed ? wiring.layers.bit(layer.text) : wiring.layers.add(layer.text))
              .has_value();
      if (has_bit || reported == layer.text) continue;
      reported = layer.text;
      const std::string bodies =
          "module " + wired.section->module.text + " has bodies in the layer '" + layer.text;
      if (world.layers_are_listed) {
        diagnostics.add(layer.place, bodies + "', which world.layers does not list" +
                                         config::suggestion(layer.text, wiring.layers.names()));
      } else {
        diagnostics.add(layer.place, bodies + "', which exceeds the limit of " +
                                         std::to_string(config::Layers::capacity) + " layers");
      }
    }
  }
}

/// The names of the entities with a shape. Modules and relations name no others.
std::vector<std::string> bodies_of(const config::World& world) {
  std::vector<std::string> bodies;
  for (const config::WorldEntity& entity : world.entities)
    if (entity.is_body()) bodies.push_back(entity.name.text);
  return bodies;
}

/// A mistake for a name that is none of `known` bodies.
std::string missing_body(const config::World& world, const std::string& name, const char* noun,
                         const char* where, const std::vector<std::string>& known) {
  for (const config::WorldEntity& entity : world.entities)
    if (!entity.is_body() && entity.name.text == name)
      return "the entity '" + name + "' has no shape; only bodies with a shape can be named here";
  return std::string("there is no ") + noun + " '" + name + "'" + where + config::suggestion(name, known);
}

/// Layers, materials and bodies that modules name have to be those of the scenario, or of earlier modules.
void check_names(const Wiring& wiring, Diagnostics& diagnostics) {
  const config::World& world = wiring.scenario->world;
  const auto for_each_missing = [](const std::vector<Word>& named, const std::vector<std::string>& known,
                                   const auto& visit) {
    for (const Word& word : named)
      if (std::find(known.begin(), known.end(), word.text) == known.end()) visit(word);
  };
  const bool all_layers_are_known = world.layers_are_listed || all_modules_exist(wiring);
  std::vector<std::string> bodies = bodies_of(world), materials, lights;
  for (const config::WorldLight& light : world.lights)
    lights.push_back(light.name.text);
  for (const config::WorldMaterial& material : world.materials)
    materials.push_back(material.name.text);
  for (const WiredModule& wired : wiring.modules) {
    if (wired.module == nullptr) return;  // its bodies are not known
    const modules::WorldPorts& ports = world_ports(wired);
    const std::vector<std::string>& layers = wiring.layers.names();
    if (all_layers_are_known) {
      for_each_missing(ports.layers, layers, [&](const Word& layer) {
        diagnostics.add(layer.place,
                        "there is no layer '" + layer.text + "'" + config::suggestion(layer.text, layers));
      });
    }
    for_each_missing(ports.materials, materials, [&](const Word& material) {
      diagnostics.add(material.place, "there is no material '" + material.text + "' in world.materials" +
                                          config::suggestion(material.text, materials));
    });
    for_each_missing(ports.lights, lights, [&](const Word& light) {
      diagnostics.add(light.place, "there is no light '" + light.text + "' in world.lights" +
                                       config::suggestion(light.text, lights));
    });
    for_each_missing(ports.bodies, bodies, [&](const Word& body) {
      diagnostics.add(body.place, missing_body(world, body.text, "body", "", bodies));
    });
    for (const std::string& made : ports.makes)
      bodies.push_back(wired.section->module.text + "." + made);
  }
}

/// Whether a layer of the search has a body that it can find.
bool has_body(const modules::BodySearch& search, const Wiring& wiring) {
  const auto is_searched = [&](const Word& layer) {
    return std::ranges::find(search.layers, layer.text, &Word::text) != search.layers.end();
  };
  const auto is_left_out = [&](const std::string& name) {
    return std::ranges::find(search.without, name, &Word::text) != search.without.end();
  };
  const auto is_found = [&](const config::WorldEntity& entity) {
    return entity.is_body() && !is_left_out(entity.name.text) &&
           std::ranges::any_of(entity.mask, is_searched);
  };
  if (std::ranges::any_of(wiring.scenario->world.entities, is_found)) return true;
  for (const WiredModule& maker : wiring.modules) {
    const modules::WorldPorts& ports = world_ports(maker);
    for (std::size_t i = 0; i < std::min(ports.makes.size(), ports.layers_of_made.size()); ++i)
      if (!is_left_out(maker.section->module.text + "." + ports.makes[i]) &&
          is_searched(ports.layers_of_made[i]))
        return true;
  }
  return false;
}

/// A module that searches layers without any other body could never find one: a mistake where it does nothing
/// else, and else a warning.
void check_searched_layers(const Wiring& wiring, Diagnostics& diagnostics) {
  if (!all_modules_exist(wiring)) return;  // the layers of their bodies are not known
  for (const WiredModule& wired : wiring.modules) {
    for (const modules::BodySearch& search : world_ports(wired).searches) {
      if (has_body(search, wiring)) continue;
      std::string layers;
      for (const Word& layer : search.layers)
        layers += (layers.empty() ? "'" : ", '") + layer.text + "'";
      const std::string text = "module " + wired.section->module.text + " searches " + layers +
                               ", where there is no other body, so it could never find one";
      if (search.is_whole_purpose)
        diagnostics.add(search.layers.front().place, text);
      else
        diagnostics.warn(search.layers.front().place, text);
    }
  }
}

/// Whether an entity or a vehicle has the light.
bool is_used(const config::WorldLight& light, const Wiring& wiring) {
  const auto has_name = [&](const Word& word) { return word.text == light.name.text; };
  for (const WiredModule& wired : wiring.modules)
    if (wired.module != nullptr && std::ranges::any_of(world_ports(wired).lights, has_name)) return true;
  return std::ranges::any_of(wiring.scenario->world.entities, [&](const config::WorldEntity& entity) {
    return entity.light && has_name(*entity.light);
  });
}

/// Whether a body has a material that emits light.
bool has_emitter(const config::World& world) {
  for (const config::WorldMaterial& material : world.materials) {
    if (material.emission_cdpm2 == std::array<double, 3>{}) continue;
    for (const config::WorldEntity& entity : world.entities)
      if (entity.material && entity.material->text == material.name.text) return true;
  }
  return false;
}

/// A light that nothing has lights nothing, and images of a world without light are black.
void check_lights(const Wiring& wiring, Diagnostics& diagnostics) {
  const config::World& world = wiring.scenario->world;
  if (!all_modules_exist(wiring)) return;  // their lights are not known
  bool is_lit = has_emitter(world);
  for (const config::WorldLight& light : world.lights) {
    if (is_used(light, wiring)) {
      is_lit = true;
    } else {
      diagnostics.warn(light.name.place,
                       "no entity names the light '" + light.name.text + "', so it lights nothing");
    }
  }
  if (is_lit) return;
  for (const WiredModule& wired : wiring.modules)
    if (world_ports(wired).needs_light)
      diagnostics.warn(wired.section->module.place, "the images of module " + wired.section->module.text +
                                                        " are black: no entity has a light, or a material "
                                                        "that emits light");
}

/// Views look at bodies of the scenario and of all modules.
void check_views(const Wiring& wiring, Diagnostics& diagnostics) {
  const config::World& world = wiring.scenario->world;
  std::vector<std::string> bodies = bodies_of(world);
  for (const WiredModule& wired : wiring.modules) {
    for (const config::WorldView& view : world.views)
      if (view.name.text == wired.section->module.text)
        diagnostics.add(view.name.place,
                        "'" + view.name.text + "' is the name of a module; give the view another name");
    if (wired.module == nullptr) continue;
    for (const std::string& made : world_ports(wired).makes)
      bodies.push_back(wired.section->module.text + "." + made);
  }
  if (world.views.empty() || !all_modules_exist(wiring)) return;  // their bodies and layers are not known
  if (bodies.empty())
    diagnostics.add(world.views.front().name.place, "the world has no bodies that a view could show");
  const std::vector<std::string>& layers = wiring.layers.names();
  for (const config::WorldView& view : world.views) {
    if (view.carrier && std::ranges::count(bodies, view.carrier->text) == 0)
      diagnostics.add(view.carrier->place, missing_body(world, view.carrier->text, "body", "", bodies));
    for (const Word& layer : view.layers)
      if (std::ranges::count(layers, layer.text) == 0)
        diagnostics.add(layer.place,
                        "there is no layer '" + layer.text + "'" + config::suggestion(layer.text, layers));
  }
}

/// A body that a module moves is an entity of the scenario, and no other module moves it.
void check_moved_bodies(const Wiring& wiring, Diagnostics& diagnostics) {
  const std::vector<std::string> bodies = bodies_of(wiring.scenario->world);
  std::map<std::string, std::string> movers;
  for (const WiredModule& wired : wiring.modules) {
    if (wired.module == nullptr) continue;
    for (const Word& body : world_ports(wired).moves) {
      if (std::find(bodies.begin(), bodies.end(), body.text) == bodies.end()) {
        diagnostics.add(body.place, missing_body(wiring.scenario->world, body.text, "entity",
                                                 " in world.entities", bodies));
        continue;
      }
      const auto [mover, is_first] = movers.emplace(body.text, wired.section->module.text);
      if (is_first) continue;
      diagnostics.add(body.place, "module " + mover->second + " moves '" + body.text +
                                      "' already; a body is moved by one module");
    }
  }
}

/// The bodies, shapes and triangles have to fit into the database.
void check_capacity(const Wiring& wiring, Diagnostics& diagnostics) {
  const config::World& world = wiring.scenario->world;
  const Scenery& scenery = wiring.scenery;
  std::size_t bodies = world.entities.size();
  std::size_t shapes = scenery.meshes.size();
  const auto too_many_shapes = [&] {
    return std::to_string(shapes) + " different shapes so far, but world.max_geometries is " +
           std::to_string(world.max_geometries);
  };
  if (shapes > world.max_geometries)
    diagnostics.add(scenery.first_entity[world.max_geometries]->shape_place, too_many_shapes());
  std::size_t triangles = 0;
  for (std::size_t i = 0; i < shapes; ++i) {
    triangles += scenery.meshes[i].triangles.size();
    if (triangles <= rtstdb::max_triangles_total) continue;
    diagnostics.add(scenery.first_entity[i]->shape_place,
                    std::to_string(triangles) + " triangles so far; all shapes together can have " +
                        std::to_string(rtstdb::max_triangles_total));
    break;
  }
  std::unordered_set<std::string> keys;
  for (const WiredModule& wired : wiring.modules) {
    if (wired.module == nullptr) continue;
    const modules::WorldPorts& ports = world_ports(wired);
    const bool bodies_did_fit = bodies <= world.max_entities;
    const bool shapes_did_fit = shapes <= world.max_geometries;
    bodies += ports.makes.size();
    for (const std::string& key : ports.shapes)
      shapes += keys.insert(key).second ? 1 : 0;
    if (bodies_did_fit && bodies > world.max_entities) {
      diagnostics.add(wired.section->module.place,
                      "module " + wired.section->module.text + ": " + std::to_string(bodies) +
                          " bodies with those before it, but world.max_entities is " +
                          std::to_string(world.max_entities));
    }
    if (shapes_did_fit && shapes > world.max_geometries) {
      diagnostics.add(wired.section->module.place,
                      "module " + wired.section->module.text + ": " + too_many_shapes());
    }
  }
}

}  // namespace

void wire_world(Wiring& wiring, Diagnostics& diagnostics) {
  wiring.scenery = make_scenery(wiring.scenario->world, diagnostics);
  add_layers(wiring, diagnostics);
  check_names(wiring, diagnostics);
  check_searched_layers(wiring, diagnostics);
  check_views(wiring, diagnostics);
  check_lights(wiring, diagnostics);
  check_moved_bodies(wiring, diagnostics);
  check_capacity(wiring, diagnostics);
}

}  // namespace hil::run
