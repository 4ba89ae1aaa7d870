"""A browser without a screen, driven through the pipe of its DevTools protocol."""

import fcntl
import json
import os
import select
import shutil
import subprocess

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")

# So long a browser may take for an answer [s]; it draws without a GPU, maybe on a machine with much else to do.
PATIENCE = 120.0


class Browser:
    """One page of Chromium. A context manager; ``errors``: what the page threw, or wrote to the console as an error."""

    def __init__(self, profile, size=(800, 600)):
        commands, self._to = os.pipe()
        self._from, answers = os.pipe()
        # It reads from 3 and writes to 4, which may be any of these here.
        ends = [fcntl.fcntl(end, fcntl.F_DUPFD, 10) for end in (commands, answers)]
        options = ["--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        options += [f"--window-size={size[0]},{size[1]}", f"--user-data-dir={profile}", "--remote-debugging-pipe"]
        command = ["bash", "-c", f'exec "$@" 3<&{ends[0]} 4>&{ends[1]}', "bash", CHROMIUM, *options]
        quiet = subprocess.DEVNULL
        self._process = subprocess.Popen(command, pass_fds=ends, stdin=quiet, stdout=quiet, stderr=quiet)
        for end in (commands, answers, *ends):
            os.close(end)
        self._read, self._asked, self._session, self.errors = b"", 0, None, []

    def __enter__(self):
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Runtime", "Log", "Page"):
            self.ask(f"{domain}.enable")
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.wait()
        os.close(self._to)
        os.close(self._from)

    def open(self, path):
        self.ask("Page.navigate", url=f"file://{path}")

    def run(self, script):
        """What the body of an async function returns."""
        answer = self.ask(
            "Runtime.evaluate", expression=f"(async () => {{{script}}})()", awaitPromise=True, returnByValue=True
        )
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def ask(self, method, **parameters):
        self._asked += 1
        message = {"id": self._asked, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self._asked:
                assert "error" not in answer, answer["error"]
                return answer["result"]
            self._note(answer.get("method"), answer.get("params", {}))

    def _note(self, event, said):
        is_error = said.get("type") == "error" or said.get("entry", {}).get("level") == "error"
        if event == "Runtime.exceptionThrown" or is_error:
            self.errors.append(said)

    def _next(self):
        while b"\0" not in self._read:
            assert select.select([self._from], [], [], PATIENCE)[0], "the browser does not answer"
            got = os.read(self._from, 1 << 16)
            assert got, "the browser has ended"
            self._read += got
        message, self._read = self._read.split(b"\0", 1)
        return json.loads(message)
