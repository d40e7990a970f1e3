// Follows the nearest person: node follow.mjs "http://127.0.0.1:8080/?token=..."
// The address with its token: gazerig ctl rigs
const page = new URL(process.argv[2]);
const api = (path) => new URL(`/api/v1/${path}`, page);
const headers = { Authorization: `Bearer ${page.searchParams.get("token")}` };

async function ask(path, message) {
  const body = message && JSON.stringify({ ...message, who: "follow.mjs" });
  const answer = await fetch(api(path), { headers, body, method: body ? "POST" : "GET" });
  const { ok, refused, failed } = await answer.json();
  if (failed) throw new Error(failed);
  if (refused) console.log(refused);
  return ok;
}

const pause = (ms) => new Promise((done) => setTimeout(done, ms));
const distance = (person) => Math.hypot(...person.position_m);

for (let last; ; await pause(500)) {
  const { state } = await ask("state");
  const [nearest] = state.people.sort((a, b) => distance(a) - distance(b));
  if (!nearest) continue;
  // Control ends by itself 2 s after this program.
  await ask("do?wait_s=0", { do: "look_at_person", id: nearest.id, for_s: 2 });
  if (nearest.id !== last) console.log(`person ${nearest.id} at ${distance(nearest).toFixed(2)} m`);
  last = nearest.id;
}
