#include "module.h"

#include <dlfcn.h>

#include <filesystem>
#include <stdexcept>

namespace holdfast::app {

void*
loadModuleFunction(const std::string& name, const std::string& function)
{
  const std::filesystem::path module =
      std::filesystem::canonical("/proc/self/exe").parent_path() / HOLDFAST_MODULES /
      (name + ".so");
  if (!std::filesystem::exists(module))
    throw std::runtime_error("this holdfast was built without its module " + name);
  // Never closed: VTK does not survive that.
  void* library = ::dlopen(module.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr)
    throw std::runtime_error(::dlerror());
  void* found = ::dlsym(library, function.c_str());
  if (found == nullptr)
    throw std::runtime_error(module.string() + ": has no " + function);
  return found;
}

} // namespace holdfast::app
