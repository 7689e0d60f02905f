// Targets that are to be followed or landed on, as the forms name them.

const $ = (id) => document.getElementById(id);
const SOURCES = { topic: "the topic", frame: "the frame", system: "MAVLink system" };
const metres = (id) => $(id).valueAsNumber || 0;

// What would be sent, without the vehicle; null without a name.
export function target() {
  const name = $("target-name").value.trim();
  if (!name) return null;
  return {
    source: $("target-source").value, target: name, ahead: metres("target-ahead"), left: metres("target-left"),
    in_map: $("target-in-map").checked, above: metres("target-above"), least: Math.max(metres("target-least"), 0), speed: Math.max(metres("speed"), 0),
  };
}

const side = (value, positive, negative) => (value ? [`${Math.abs(value)} m ${value < 0 ? negative : positive}`] : []);

export function describedTarget({ source, target: name, ahead, left, above, in_map: inMap }) {
  const axes = inMap ? [["to the east", "to the west"], ["to the north", "to the south"]] : [["ahead", "behind"], ["left", "right"]];
  const place = [...side(ahead, ...axes[0]), ...side(left, ...axes[1]), ...side(above, "above", "below")];
  return `${SOURCES[source]} ${name}, ${place.join(", ") || "at no distance"}`;
}

// Where to land: members of the command.
export function landing() {
  const retries = Math.round($("land-retries").valueAsNumber || 0);
  return { target: $("land-target").value.trim(), required: $("land-required").checked, retries: Math.min(Math.max(retries, 0), 255) };
}

export function describedLanding({ target: topic, required, retries }) {
  if (!topic) return "Land";
  const again = retries ? `, searching again ${retries} ${retries === 1 ? "time" : "times"}` : "";
  return `Land on the target of ${topic}${again}, and ${required ? "hold" : "land where it is"} without it, with`;
}

// How it is going, for the readout of the goal; "" if nothing is followed.
export function followed(found) {
  if (!found) return "";
  if (found.state === "ACQUIRING") return "looking for the target";
  if (found.state === "LOST") return `target lost${found.age === null ? "" : ` for ${found.age.toFixed(0)} s`}`;
  return found.distance === null ? "following" : `target ${found.distance.toFixed(1)} m away`;
}
