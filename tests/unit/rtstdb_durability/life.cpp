#include "life.hpp"

#include <algorithm>

namespace rtstdb::transaction::test {

void Model::declare(Transaction& transaction, std::mt19937_64& random) {
  declared_.clear();
  Image image = now_;
  for (std::uint64_t k = 1 + random() % 3; k > 0; --k) {
    Op op;
    op.material = ++materials_;
    const auto living = static_cast<std::uint64_t>(std::ranges::count(image, true, &Slot::lives));
    const std::uint64_t kind = random() % 8;
    if (living == 0 || (kind < 2 && living < room)) {
      op.index = static_cast<std::uint32_t>(std::ranges::find(image, false, &Slot::lives) - image.begin());
      image[op.index].lives = true;
      ++image[op.index].generation;
      transaction.create(body(op.material));
    } else {
      std::uint64_t chosen = random() % living;
      while (!image[op.index].lives || chosen-- != 0)
        ++op.index;
      const EntityId id{op.index, image[op.index].generation};
      op.kind = kind < 7 ? Op::Kind::update : Op::Kind::remove;
      if (op.kind == Op::Kind::update) {
        transaction.update(id, body(op.material));
      } else {
        transaction.remove(id);
        image[op.index].lives = false;
      }
    }
    declared_.push_back(op);
  }
}

Image Model::after(Version version) const {
  Image image = now_;
  for (const Op& op : declared_) {
    Slot& slot = image[op.index];
    if (op.kind == Op::Kind::create) ++slot.generation;
    slot.lives = op.kind != Op::Kind::remove;
    slot.material = slot.lives ? op.material : 0;
    slot.written_by = slot.lives ? version : 0;
  }
  return image;
}

void Model::is_done(Version version) {
  now_ = images_[version] = after(version);
  certain_[version] = true;
}

void Model::may_be_done(Version version) {
  images_[version] = after(version);
  certain_[version] = false;
}

void Model::go_on_at(Version version) {
  now_ = images_.at(version);
  images_.erase(images_.upper_bound(version), images_.end());
  certain_.erase(certain_.upper_bound(version), certain_.end());
  certain_[version] = true;
}

const Outcome& Life::commit(Model& model, std::mt19937_64& random, const Terms& given) {
  const Version before = engine.latest().version;
  transaction_->begin(given);
  model.declare(*transaction_, random);
  const Outcome& outcome = execute(*transaction_);
  if (outcome.done()) {
    EXPECT_GT(outcome.version, before);
    model.is_done(outcome.version);
  } else if (outcome.in_doubt) {
    EXPECT_EQ(engine.latest().version, before) << describe(outcome);
    model.may_be_done(outcome.version);
  }
  return outcome;
}

Image Life::image() {
  Image image(Model::room);
  const auto states = engine.snapshot(ReadAt::latest());
  for (const EntityState& state : states.value())
    image[state.id.index] = {state.id.generation, true, state.row.material, state.written_by};
  return image;
}

}  // namespace rtstdb::transaction::test
