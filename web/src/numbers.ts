/** Numbers and moments in the language of the page. */

let locale = "en";
let square = new Intl.NumberFormat(locale, { minimumFractionDigits: 1, maximumFractionDigits: 1 });

export const currentLocale = (): string => locale;

export function setLocale(wanted: string): void {
  locale = wanted;
  square = new Intl.NumberFormat(wanted, { minimumFractionDigits: 1, maximumFractionDigits: 1 });
}

export const area = (metres2: number): string => `${square.format(metres2)} m²`;
export const count = (n: number, one: string, many: string): string => `${n} ${n === 1 ? one : many}`;
