#include "logged_engine.hpp"

#include <algorithm>

namespace rtstdb::transaction::test {

void Model::declare(Transaction& transaction, std::mt19937_64& random) {
  declared_.clear();
  Image image = now_;
  for (std::uint64_t k = 1 + random() % 3; k > 0; --k) {
    Op op;
    op.mask = ++masks_;
    const auto existing = static_cast<std::uint64_t>(std::ranges::count(image, true, &Slot::exists));
    const std::uint64_t kind = random() % 8;
    if (existing == 0 || (kind < 2 && existing < capacity)) {
      op.index = static_cast<std::uint32_t>(std::ranges::find(image, false, &Slot::exists) - image.begin());
      image[op.index].exists = true;
      ++image[op.index].generation;
      transaction.create(body(op.mask));
    } else {
      std::uint64_t chosen = random() % existing;
      while (!image[op.index].exists || chosen-- != 0)
        ++op.index;
      const EntityId id{op.index, image[op.index].generation};
      op.kind = kind < 7 ? Op::Kind::update : Op::Kind::remove;
      if (op.kind == Op::Kind::update) {
        transaction.update(id, body(op.mask));
      } else {
        transaction.remove(id);
        image[op.index].exists = false;
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
    slot.exists = op.kind != Op::Kind::remove;
    slot.mask = slot.exists ? op.mask : 0;
    slot.written_by = slot.exists ? version : 0;
  }
  return image;
}

void Model::commit(Version version) {
  now_ = images_[version] = after(version);
  certain_[version] = true;
}

void Model::commit_in_doubt(Version version) {
  images_[version] = after(version);
  certain_[version] = false;
}

void Model::continue_at(Version version) {
  now_ = images_.at(version);
  images_.erase(images_.upper_bound(version), images_.end());
  certain_.erase(certain_.upper_bound(version), certain_.end());
  certain_[version] = true;
}

const Outcome& LoggedEngine::commit(Model& model, std::mt19937_64& random, const Terms& given) {
  const Version before = engine.latest().version;
  transaction_->begin(given);
  model.declare(*transaction_, random);
  const Outcome& outcome = execute(*transaction_);
  if (outcome.done()) {
    EXPECT_GT(outcome.version, before);
    model.commit(outcome.version);
  } else if (outcome.in_doubt) {
    EXPECT_EQ(engine.latest().version, before) << describe(outcome);
    model.commit_in_doubt(outcome.version);
  }
  return outcome;
}

Image LoggedEngine::image() {
  Image image(Model::capacity);
  const auto states = engine.snapshot(ReadAt::latest());
  for (const EntityState& state : states.value())
    image[state.id.index] = {state.id.generation, true, state.row.mask, state.written_by};
  return image;
}

}  // namespace rtstdb::transaction::test
