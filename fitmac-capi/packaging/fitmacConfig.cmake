# Targets: fitmac::fitmac (shared library), fitmac::static (static library);
# both bring fitmac.h and, for C++17, fitmac.hpp.
get_filename_component(_fitmac_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)

if(NOT TARGET fitmac::fitmac)
  add_library(fitmac::fitmac SHARED IMPORTED)
  set_target_properties(fitmac::fitmac PROPERTIES
    IMPORTED_LOCATION "${_fitmac_prefix}/lib/libfitmac.so.@VERSION@"
    IMPORTED_SONAME "libfitmac.so.@ABI@"
    INTERFACE_INCLUDE_DIRECTORIES "${_fitmac_prefix}/include")
endif()

if(NOT TARGET fitmac::static)
  add_library(fitmac::static STATIC IMPORTED)
  set_target_properties(fitmac::static PROPERTIES
    IMPORTED_LOCATION "${_fitmac_prefix}/lib/libfitmac.a"
    INTERFACE_INCLUDE_DIRECTORIES "${_fitmac_prefix}/include"
    INTERFACE_LINK_LIBRARIES "@SYSTEM_LIBRARIES@")
endif()

unset(_fitmac_prefix)
