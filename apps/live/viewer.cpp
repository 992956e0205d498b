#include "viewer.h"

#include <dlfcn.h>

#include <filesystem>
#include <stdexcept>

namespace holdfast::app {

std::unique_ptr<Viewer>
openViewer(const std::string& note)
{
  // Beside the program, in the build folder as when installed.
  const std::filesystem::path module =
      std::filesystem::canonical("/proc/self/exe").parent_path() / HOLDFAST_VIEWER;
  if (!std::filesystem::exists(module))
    throw std::runtime_error("--view: this holdfast was built without its viewer");
  // Never closed: VTK does not survive that.
  void* library = ::dlopen(module.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr)
    throw std::runtime_error(std::string("--view: ") + ::dlerror());
  const auto open = reinterpret_cast<decltype(&holdfastOpenViewer)>(
      ::dlsym(library, "holdfastOpenViewer"));
  if (open == nullptr)
    throw std::runtime_error(module.string() + ": is no viewer");
  return std::unique_ptr<Viewer>(open(note));
}

} // namespace holdfast::app
