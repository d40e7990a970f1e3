// The browser's webcam as the camera of an emulated rig.
//
// Images of 640 x 480 are sent as JPEGs to the door, each after the last was accepted, at most fifteen
// a second, until the button is pressed again, the page is closed or the camera is gone.

import { on, openSocket } from "/rig/connection.js";
import { say } from "/rig/orders.js";

const EVERY_MS = 1000 / 15;
const WIDTH = 640, HEIGHT = 480, QUALITY = 0.8;
const ELSEWHERE = "Browsers lend their camera only to pages of their own computer: on the rig's "
  + "computer, start it with --camera 0.";

const button = document.querySelector("#webcam");
let stream = null, socket = null, timer = 0, sentAt = 0;

/** Request the camera and send its images. */
async function begin() {
  // A browser lends its camera only if the address is secure.
  if (!window.isSecureContext || !navigator.mediaDevices?.getUserMedia) return say(ELSEWHERE);
  button.disabled = true;
  try {
    stream = await navigator.mediaDevices.getUserMedia({
      audio: false,
      video: { width: { ideal: WIDTH }, height: { ideal: HEIGHT }, facingMode: "user" },
    });
  } catch (error) {
    return say(error.name === "NotAllowedError" ? "The browser was not allowed to use its camera."
      : `No camera of this browser can be used (${error.name}).`);
  } finally {
    button.disabled = false;
  }
  const video = document.createElement("video");
  video.muted = video.playsInline = true;
  video.srcObject = stream;
  stream.getVideoTracks()[0].addEventListener("ended", end);
  await video.play();
  socket = openSocket("/api/v1/webcam");
  const mine = socket;
  const canvas = document.createElement("canvas");
  const send = () => {
    if (mine.readyState !== WebSocket.OPEN) return;
    const scale = Math.min(1, WIDTH / (video.videoWidth || WIDTH));
    canvas.width = Math.round((video.videoWidth || WIDTH) * scale);
    canvas.height = Math.round((video.videoHeight || HEIGHT) * scale);
    canvas.getContext("2d").drawImage(video, 0, 0, canvas.width, canvas.height);
    sentAt = performance.now();
    canvas.toBlob((blob) => {
      if (blob && mine.readyState === WebSocket.OPEN) mine.send(blob);
    }, "image/jpeg", QUALITY);
  };
  mine.onopen = send;
  mine.onmessage = (event) => {
    if (event.data !== "next") { say(event.data); end(); return; }
    timer = setTimeout(send, Math.max(0, EVERY_MS - (performance.now() - sentAt)));
  };
  mine.onclose = () => { if (socket === mine) end(); };
  button.setAttribute("aria-pressed", "true");
  say("The head looks through this browser's camera.");
}

/** Stop the camera; the rig shows the scene again. */
function end() {
  clearTimeout(timer);
  stream?.getTracks().forEach((track) => track.stop());
  const last = socket;
  stream = socket = null;
  last?.close();
  button.setAttribute("aria-pressed", "false");
}

button.addEventListener("click", () => (stream ? end() : begin()));
on("rig", ({ emulated }) => { // a real rig has its own camera at its eyes
  button.hidden = !emulated;
  if (button.hidden && stream) end();
});
