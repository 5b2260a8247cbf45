import type { Schemas } from "../api/client";
import classes from "./Fleet.module.css";
import { fleetTexts } from "./texts";

const words = fleetTexts.rollouts;
const RESOLVERS = {
  both: ["meta_occupancy", "meta_dividers"],
  occupancy: ["meta_occupancy"],
  none: [],
} as const satisfies Record<string, readonly Schemas["NewRollout"]["resolvers"][number][]>;

export interface Setting {
  readonly resolvers: keyof typeof RESOLVERS;
  /** JSON, as it is typed. */
  readonly params: string;
}

export const CODES_OWN: Setting = { resolvers: "both", params: "{}" };

export function isUsable({ params }: Setting): boolean {
  try {
    const found: unknown = JSON.parse(params);
    return typeof found === "object" && found !== null && !Array.isArray(found);
  } catch {
    return false;
  }
}

/** As the API takes it. */
export const settingOf = ({ resolvers, params }: Setting) => ({
  resolvers: [...RESOLVERS[resolvers]],
  params: JSON.parse(params) as Schemas["NewRollout"]["params"],
});

interface Props {
  readonly setting: Setting;
  readonly change: (setting: Setting) => void;
}

/** A setting of the pipeline. */
export function SettingFields({ setting, change }: Props) {
  return (
    <>
      <label className={classes.select}>
        {words.resolvers}
        <select
          value={setting.resolvers}
          onChange={({ currentTarget: { value } }) => change({ ...setting, resolvers: value as Setting["resolvers"] })}
        >
          {Object.entries(words.resolverSets).map(([key, said]) => (
            <option key={key} value={key}>
              {said}
            </option>
          ))}
        </select>
      </label>
      <label className={classes.select}>
        {words.params}
        <input
          value={setting.params}
          aria-invalid={!isUsable(setting)}
          spellCheck={false}
          onChange={({ currentTarget: { value } }) => change({ ...setting, params: value })}
        />
      </label>
    </>
  );
}
