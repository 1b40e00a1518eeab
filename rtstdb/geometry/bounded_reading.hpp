#pragma once
// How assimp gets to read files: a reader that keeps asking past the end of a broken file is stopped by an
// exception. Without that, some readers (a cut-off header) ask for ever.

#include <assimp/DefaultIOSystem.h>

namespace rtstdb {

class BoundedReading final : public Assimp::DefaultIOSystem {
 public:
  Assimp::IOStream* Open(const char* path, const char* mode) override;
};

}  // namespace rtstdb
