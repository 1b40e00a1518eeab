#include "bench/contact/fcl_bodies.hpp"

#include <fcl/fcl.h>

#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {
namespace {

fcl::Transform3d transform_of(const rtstdb::Pose& pose) {
  fcl::Transform3d transform = fcl::Transform3d::Identity();
  transform.translation() = fcl::Vector3d(pose.p_world_m.x, pose.p_world_m.y, pose.p_world_m.z);
  transform.linear() =
      fcl::Quaterniond(pose.q_world.w, pose.q_world.x, pose.q_world.y, pose.q_world.z).toRotationMatrix();
  return transform;
}

std::shared_ptr<fcl::Convexd> convex_of(const rtstdb::TriangleMesh& mesh) {
  auto vertices = std::make_shared<std::vector<fcl::Vector3d>>();
  for (const glm::vec3& p : mesh.positions_m)
    vertices->emplace_back(p.x, p.y, p.z);
  auto faces = std::make_shared<std::vector<int>>();
  for (const glm::uvec3& triangle : mesh.triangles)
    faces->insert(faces->end(), {3, static_cast<int>(triangle.x), static_cast<int>(triangle.y),
                                 static_cast<int>(triangle.z)});
  auto convex = std::make_shared<fcl::Convexd>(vertices, static_cast<int>(mesh.triangles.size()), faces);
  convex->computeLocalAABB();
  return convex;
}

}  // namespace

std::string fcl_version() {
  return "FCL " FCL_VERSION;
}

struct FclPairs::Impl {
  std::vector<fcl::CollisionObjectd> bodies;
};

FclPairs::FclPairs(std::span<const rtstdb::TriangleMesh> meshes, std::span<const rtstdb::EntityRow> rows)
    : impl_(std::make_unique<Impl>()) {
  std::vector<std::shared_ptr<fcl::Convexd>> shapes;
  for (const rtstdb::TriangleMesh& mesh : meshes)
    shapes.push_back(convex_of(mesh));
  for (const rtstdb::EntityRow& row : rows)
    impl_->bodies.emplace_back(shapes[row.geometry.index],
                               transform_of(rtstdb::pose_at(row.motion, row.motion.valid_from)));
}

FclPairs::~FclPairs() = default;

void FclPairs::find(std::vector<PeerContact>& contacts) const {
  contacts.resize(impl_->bodies.size() / 2);
  over_chunks(contacts.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const fcl::CollisionObjectd& first = impl_->bodies[2 * i];
      const fcl::CollisionObjectd& second = impl_->bodies[2 * i + 1];
      fcl::CollisionResultd found;
      fcl::collide(&first, &second, fcl::CollisionRequestd(1, true), found);
      PeerContact& contact = contacts[i];
      contact.touches = found.isCollision();
      if (contact.touches) {
        contact.distance_m = -found.getContact(0).penetration_depth;
        continue;
      }
      fcl::DistanceResultd apart;
      contact.distance_m = fcl::distance(&first, &second, fcl::DistanceRequestd(true), apart);
    }
  });
}

struct FclTree::Impl {
  std::vector<rtstdb::EntityRow> rows;
  std::vector<std::unique_ptr<fcl::CollisionObjectd>> bodies;
  fcl::DynamicAABBTreeCollisionManagerd tree;
};

FclTree::FclTree(const rtstdb::Bounds& bounds, std::span<const rtstdb::EntityRow> rows)
    : impl_(std::make_unique<Impl>()) {
  const glm::dvec3 size = glm::dvec3(bounds.maximum_m) - glm::dvec3(bounds.minimum_m);
  const auto box = std::make_shared<fcl::Boxd>(size.x, size.y, size.z);
  box->computeLocalAABB();
  impl_->rows.assign(rows.begin(), rows.end());
  for (const rtstdb::EntityRow& row : rows) {
    impl_->bodies.push_back(std::make_unique<fcl::CollisionObjectd>(
        box, transform_of(rtstdb::pose_at(row.motion, row.motion.valid_from))));
    impl_->tree.registerObject(impl_->bodies.back().get());
  }
  impl_->tree.setup();
}

FclTree::~FclTree() = default;

std::size_t FclTree::overlapping_pairs(rtstdb::WorldTime t) {
  for (std::size_t i = 0; i < impl_->bodies.size(); ++i) {
    impl_->bodies[i]->setTransform(transform_of(rtstdb::pose_at(impl_->rows[i].motion, t)));
    impl_->bodies[i]->computeAABB();
  }
  impl_->tree.update();
  std::size_t pairs = 0;
  impl_->tree.collide(&pairs, [](fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* data) {
    fcl::CollisionResultd found;
    fcl::collide(a, b, fcl::CollisionRequestd(), found);
    if (found.isCollision()) ++*static_cast<std::size_t*>(data);
    return false;
  });
  return pairs;
}

}  // namespace hil::bench
