/// \file A matrix that few results have.
#pragma once

#include <memory>

namespace holdfast {

/// A matrix of no entries unless it is given some: takes memory, from the heap, only
/// then. Results by the hundred thousand stay small that way.
template <typename Matrix>
class RareMatrix {
public:
  RareMatrix() = default;
  RareMatrix(const Matrix& matrix) : entries_(copyOf(matrix)) {}
  RareMatrix(const RareMatrix& other)
  : entries_(other.entries_ ? copyOf(*other.entries_) : nullptr)
  {}
  RareMatrix(RareMatrix&&) noexcept = default;

  RareMatrix& operator=(const RareMatrix& other)
  {
    if (this != &other)
      entries_ = other.entries_ ? copyOf(*other.entries_) : nullptr;
    return *this;
  }
  RareMatrix& operator=(RareMatrix&&) noexcept = default;

  RareMatrix& operator=(const Matrix& matrix)
  {
    entries_ = copyOf(matrix);
    return *this;
  }

  ~RareMatrix() = default;

  const Matrix& operator*() const
  {
    static const Matrix kNone{};
    return entries_ ? *entries_ : kNone;
  }

  const Matrix* operator->() const
  {
    return &**this;
  }

private:
  static std::unique_ptr<const Matrix> copyOf(const Matrix& matrix)
  {
    return matrix.size() > 0 ? std::make_unique<const Matrix>(matrix) : nullptr;
  }

  std::unique_ptr<const Matrix> entries_;
};

} // namespace holdfast
