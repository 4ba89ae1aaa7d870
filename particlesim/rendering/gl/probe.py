"""Open one OpenGL context without a window and print what it says, as JSON. Run as a script in a process of its own.

A bad driver may crash, hang or print; a child process shields the caller from all three. Only ctypes is used, so
that the child starts at once.
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import sys
from typing import Any

# Names of the constants below are those of the EGL, OSMesa and OpenGL headers of the Khronos registry and of Mesa.
EGL_NONE = 0x3038
EGL_SURFACE_TYPE, EGL_PBUFFER_BIT = 0x3033, 0x0001
EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_OPENGL_API = 0x3040, 0x0008, 0x30A2
EGL_DEPTH_SIZE = 0x3025
EGL_PLATFORM_DEVICE_EXT = 0x313F
EGL_CONTEXT_MAJOR_VERSION, EGL_CONTEXT_MINOR_VERSION = 0x3098, 0x30FB
EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT = 0x30FD, 0x0001
OSMESA_FORMAT, OSMESA_RGBA, OSMESA_DEPTH_BITS = 0x22, 0x1908, 0x30
OSMESA_PROFILE, OSMESA_CORE_PROFILE = 0x33, 0x34
OSMESA_CONTEXT_MAJOR_VERSION, OSMESA_CONTEXT_MINOR_VERSION = 0x36, 0x37
GL_UNSIGNED_BYTE = 0x1401
GL_STRINGS = {"vendor": 0x1F00, "renderer": 0x1F01, "version": 0x1F02}


def _ints(*values: int) -> Any:
    return (ctypes.c_int * len(values))(*values)


def _function(address: Any, result: Any, *arguments: Any) -> Any:
    if not address:
        raise OSError("the driver lacks a function that is needed")
    return ctypes.CFUNCTYPE(result, *arguments)(address)


def _strings(find: Any) -> dict[str, str]:
    get_string = _function(find(b"glGetString"), ctypes.c_char_p, ctypes.c_uint)
    return {name: (get_string(code) or b"").decode(errors="replace") for name, code in GL_STRINGS.items()}


def _egl_devices(find: Any) -> list[Any]:
    query = _function(
        find(b"eglQueryDevicesEXT"), ctypes.c_uint, ctypes.c_int, ctypes.c_void_p, ctypes.POINTER(ctypes.c_int)
    )
    count = ctypes.c_int()
    query(0, None, ctypes.byref(count))
    devices = (ctypes.c_void_p * max(count.value, 1))()
    query(count.value, devices, ctypes.byref(count))
    return list(devices[: count.value])


def _egl_context(egl: Any, display: Any) -> bool:
    if not display or not egl.eglInitialize(display, None, None):
        return False
    wanted = (EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_DEPTH_SIZE, 24)
    config, count = ctypes.c_void_p(), ctypes.c_int()
    egl.eglChooseConfig(display, _ints(*wanted, EGL_NONE), ctypes.byref(config), 1, ctypes.byref(count))
    if not count.value or not egl.eglBindAPI(EGL_OPENGL_API):
        return False
    version = (EGL_CONTEXT_MAJOR_VERSION, 4, EGL_CONTEXT_MINOR_VERSION, 1)
    profile = (EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT)
    context = egl.eglCreateContext(display, config, None, _ints(*version, *profile, EGL_NONE))
    return bool(context and egl.eglMakeCurrent(display, None, None, ctypes.c_void_p(context)))


def _load_any(*names: str) -> None:
    """Load the first of the libraries that is there. OSError if none is."""
    for name in names:
        with contextlib.suppress(OSError):
            ctypes.CDLL(name, mode=ctypes.RTLD_GLOBAL)
            return
    raise OSError(f"neither of {', '.join(names)} loads")


def probe_egl() -> dict[str, Any]:
    """The first EGL device on which a context opens; a driver lists its software device last. OSError if none."""
    _load_any("libOpenGL.so.0", "libGL.so.1")
    egl = ctypes.CDLL("libEGL.so.1", mode=ctypes.RTLD_GLOBAL)
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    egl.eglCreateContext.restype = ctypes.c_void_p
    egl.eglCreateContext.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p]
    egl.eglMakeCurrent.argtypes = [ctypes.c_void_p] * 4
    egl.eglInitialize.argtypes = [ctypes.c_void_p] * 3
    egl.eglChooseConfig.argtypes = [ctypes.c_void_p] * 3 + [ctypes.c_int, ctypes.c_void_p]
    find = egl.eglGetProcAddress
    display_of = _function(
        find(b"eglGetPlatformDisplayEXT"), ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p
    )
    wanted = os.environ.get("EGL_DEVICE_ID")
    for index, device in enumerate(_egl_devices(find)):
        if wanted not in (None, str(index)):
            continue
        if _egl_context(egl, display_of(EGL_PLATFORM_DEVICE_EXT, device, None)):
            return {"device": index, **_strings(find)}
    raise OSError("EGL is installed but no device of it opens an OpenGL 4.1 context")


def load_folder(folder: str, name: str) -> ctypes.CDLL:
    """Load all libraries in a folder, and return the one whose file's name starts with ``name``.

    Libraries in a wheel ask for each other by names of their own, but do not say where the others are: each loads once
    those that it asks for are loaded.

    Raises
    ------
    OSError
        If one does not load, or none has that name.
    """
    waiting = sorted(entry.path for entry in os.scandir(folder))
    loaded: dict[str, ctypes.CDLL] = {}
    while waiting:
        reasons = {path: error for path in waiting if (error := _load_into(loaded, path))}
        if len(reasons) == len(waiting):
            raise reasons[waiting[0]]
        waiting = list(reasons)
    for path, library in loaded.items():
        if os.path.basename(path).startswith(name):
            return library
    raise OSError(f"{folder} holds no {name}")


def _load_into(loaded: dict[str, ctypes.CDLL], path: str) -> OSError | None:
    """Load a library, for itself alone: its names are not those of the system's. The error if it does not load."""
    try:
        loaded[path] = ctypes.CDLL(path)
    except OSError as error:
        return error
    return None


def probe_osmesa(folder: str) -> dict[str, Any]:
    """An OSMesa context, of the libraries in a folder if one is given. OSError if there is none."""
    mesa = load_folder(folder, "libOSMesa") if folder else ctypes.CDLL("libOSMesa.so.8", mode=ctypes.RTLD_GLOBAL)
    mesa.OSMesaCreateContextAttribs.restype = ctypes.c_void_p
    mesa.OSMesaGetProcAddress.restype = ctypes.c_void_p
    version = (OSMESA_CONTEXT_MAJOR_VERSION, 3, OSMESA_CONTEXT_MINOR_VERSION, 3)
    wanted = (OSMESA_FORMAT, OSMESA_RGBA, OSMESA_DEPTH_BITS, 24, OSMESA_PROFILE, OSMESA_CORE_PROFILE)
    context = ctypes.c_void_p(mesa.OSMesaCreateContextAttribs(_ints(*wanted, *version, 0), None))
    if not context or not mesa.OSMesaMakeCurrent(
        context, ctypes.create_string_buffer(64 * 64 * 4), GL_UNSIGNED_BYTE, 64, 64
    ):
        raise OSError("OSMesa is installed but opens no OpenGL 3.3 context")
    return {"device": None, **_strings(mesa.OSMesaGetProcAddress)}


if __name__ == "__main__":
    try:
        answer = probe_egl() if sys.argv[1] == "egl" else probe_osmesa(sys.argv[2])
    except OSError as error:
        answer = {"error": str(error)}
    print(json.dumps(answer), flush=True)
    # Drivers may crash while they are unloaded, when the answer is already known.
    os._exit(0)
